//! An archive of arrays, alone and as a trial.

use std::io::Cursor;

use hydro_files::Archive;

use super::{csv, refused};

/// Reads every array of an archive, then the archive as a trial.
pub fn read(bytes: &[u8]) -> bool {
    match Archive::open(Cursor::new(bytes)) {
        Ok(mut archive) => {
            for name in archive.names() {
                let array = archive.numbers(&name);
                match array {
                    Ok(Some(array)) => {
                        let size: u64 = array.shape.iter().product();
                        assert_eq!(size, array.values.len() as u64, "{name}");
                    }
                    Ok(None) => {}
                    Err(error) => {
                        refused(&error);
                    }
                }
                if let Err(error) = archive.text(&name) {
                    refused(&error);
                }
            }
        }
        Err(error) => {
            refused(&error);
        }
    }
    csv::trial("npz/dive.npz", bytes)
}
