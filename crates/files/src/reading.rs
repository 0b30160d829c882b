//! Reading a file after a look at what it is.

use std::{
    fs::{File, FileType, OpenOptions},
    io::{Error, ErrorKind, Read as _, Result},
    os::unix::fs::{FileTypeExt as _, OpenOptionsExt as _},
    path::Path,
};

use rustix::fs::OFlags;

/// Largest text file [byte]: a card, a manifest, a model, a table of settings.
pub const TEXT: u64 = 1 << 26;

/// Opens a file of at most `most` bytes, and gives its size.
///
/// # Errors
/// A pipe, a device, a socket, a folder; a larger file; what the system says.
pub fn open(path: &Path, most: u64) -> Result<(File, u64)> {
    // Without the flag the opening of a pipe waits for somebody to write.
    let file = OpenOptions::new()
        .read(true)
        .custom_flags(OFlags::NONBLOCK.bits().cast_signed())
        .open(path)?;
    let about = file.metadata()?;
    if !about.is_file() {
        let kind = kind(about.file_type());
        return Err(Error::other(format!("is {kind}; expected a file")));
    }
    let size = about.len();
    if size > most {
        return Err(Error::other(format!(
            "is {size} bytes; expected {most} at most"
        )));
    }
    Ok((file, size))
}

/// Content of a file of at most `most` bytes.
///
/// # Errors
/// As [`open`]; too little memory.
pub fn read(path: &Path, most: u64) -> Result<Vec<u8>> {
    let (file, size) = open(path, most)?;
    let mut bytes = Vec::new();
    let length = usize::try_from(size).map_err(|_| ErrorKind::OutOfMemory)?;
    bytes
        .try_reserve_exact(length.saturating_add(1))
        .map_err(|_| Error::other(format!("is {size} bytes, more than the memory holds")))?;
    // It may grow while it is read.
    file.take(most).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Text of a file of at most `most` bytes.
///
/// # Errors
/// As [`read`]; bytes that are not UTF-8.
pub fn read_text(path: &Path, most: u64) -> Result<String> {
    String::from_utf8(read(path, most)?).map_err(|error| {
        Error::new(
            ErrorKind::InvalidData,
            format!(
                "is not UTF-8 text (byte {})",
                error.utf8_error().valid_up_to()
            ),
        )
    })
}

fn kind(kind: FileType) -> &'static str {
    if kind.is_dir() {
        "a folder"
    } else if kind.is_fifo() {
        "a pipe"
    } else if kind.is_socket() {
        "a socket"
    } else {
        "a device"
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn refusal(path: &Path) -> String {
        read(path, TEXT).unwrap_err().to_string()
    }

    #[test]
    fn what_is_no_file_is_refused_by_its_kind() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(refusal(folder.path()), "is a folder; expected a file");
        assert_eq!(
            refusal(Path::new("/dev/zero")),
            "is a device; expected a file"
        );
        let pipe = folder.path().join("pipe");
        rustix::fs::mknodat(
            rustix::fs::CWD,
            &pipe,
            rustix::fs::FileType::Fifo,
            rustix::fs::Mode::RUSR,
            0,
        )
        .unwrap();
        assert_eq!(refusal(&pipe), "is a pipe; expected a file");
    }

    #[test]
    fn a_size_is_looked_at_before_memory_is_taken() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sparse");
        File::create(&path).unwrap().set_len(1 << 40).unwrap();
        assert_eq!(
            refusal(&path),
            "is 1099511627776 bytes; expected 67108864 at most"
        );
        std::fs::write(&path, "wet").unwrap();
        assert_eq!(read_text(&path, 3).unwrap(), "wet");
        assert!(read(&path, 2).is_err());
        std::fs::write(&path, b"caf\xe9").unwrap();
        let message = read_text(&path, TEXT).unwrap_err().to_string();
        assert_eq!(message, "is not UTF-8 text (byte 3)");
    }
}
