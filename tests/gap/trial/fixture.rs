//! A small model and files of its trials.

use std::{
    fs,
    path::{Path, PathBuf},
};

use hydro_gap::trial::{
    Remark, RemarkKind, SensorQuantity, SensorSignature, Signature, Trial, read,
};
use npyz::{WriteOptions, WriterBuilder as _};
use tempfile::TempDir;
use zip::{CompressionMethod, ZipWriter, write::SimpleFileOptions};

pub(crate) fn sensor(name: &str, dim: usize, kind: SensorQuantity) -> SensorSignature {
    let name = name.to_owned();
    SensorSignature { name, dim, kind }
}

pub(crate) fn names(names: &[&str]) -> Vec<String> {
    names.iter().map(|name| (*name).to_owned()).collect()
}

/// Two actuators, seven sensor columns, a state of four numbers: time, qpos 2, qvel 1.
pub(crate) fn signature() -> Signature {
    Signature {
        actuators: names(&["left", "right"]),
        sensors: vec![
            sensor("gyro", 2, SensorQuantity::Other),
            sensor("quat", 4, SensorQuantity::Quaternion),
            sensor("hip", 1, SensorQuantity::Angle),
        ],
        joints: Vec::new(),
        state_len: 4,
        timestep: 0.1,
    }
}

pub(crate) struct Folder(pub(crate) TempDir);

impl Folder {
    pub(crate) fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub(crate) fn text(&self, text: &str) -> PathBuf {
        let path = self.path("run.csv");
        fs::write(&path, text).unwrap();
        path
    }
}

pub(crate) fn accepted_csv(text: &str) -> (Trial, Vec<Remark>) {
    let folder = Folder::new();
    read(&folder.text(text), &signature()).unwrap_or_else(|error| panic!("{error}"))
}

/// The message must hold every one of `parts`, and the file's name.
pub(crate) fn refused(path: &Path, parts: &[&str]) {
    let message = read(path, &signature()).unwrap_err().to_string();
    let file = path.file_name().unwrap().to_str().unwrap();
    for part in parts.iter().chain([&file]) {
        assert!(message.contains(part), "`{part}` is not in: {message}");
    }
}

pub(crate) fn refused_csv(text: &str, parts: &[&str]) {
    let folder = Folder::new();
    refused(&folder.text(text), parts);
}

/// Arrays of an npz, changed one at a time by the tests.
#[derive(Clone)]
pub(crate) struct Arrays(
    pub(crate) Vec<(String, Vec<u64>, Vec<f64>)>,
    Vec<(String, String)>,
);

impl Arrays {
    pub(crate) fn new() -> Self {
        let rows = 4;
        let times: Vec<f64> = (0..rows).map(|row| 0.1 * row as f64).collect();
        let quat = [0.0, 0.1, 1.0, 0.0, 0.0, 0.0, 0.5];
        let sensors = (0..rows).flat_map(|_| quat).collect();
        let control = (0..2 * rows).map(|value| value as f64).collect();
        let array = |name: &str, shape: &[usize], values: Vec<f64>| {
            let shape = shape.iter().map(|size| *size as u64).collect();
            (name.to_owned(), shape, values)
        };
        Self(
            vec![
                array("control_times", &[rows], times.clone()),
                array("control_data", &[rows, 2], control),
                array("sensordata_times", &[rows], times),
                array("sensordata_data", &[rows, 7], sensors),
                array("initial_state", &[4], vec![0.0; 4]),
            ],
            Vec::new(),
        )
    }

    pub(crate) fn set(mut self, name: &str, at: usize, value: f64) -> Self {
        let array = self.0.iter_mut().find(|array| array.0 == name).unwrap();
        array.2[at] = value;
        self
    }

    pub(crate) fn shaped(mut self, name: &str, shape: &[u64]) -> Self {
        let array = self.0.iter_mut().find(|array| array.0 == name);
        let len = shape.iter().product::<u64>() as usize;
        match array {
            Some(array) => {
                array.1 = shape.to_vec();
                array.2.resize(len, 0.5);
            }
            None => self
                .0
                .push((name.to_owned(), shape.to_vec(), vec![0.5; len])),
        }
        self
    }

    pub(crate) fn without(mut self, name: &str) -> Self {
        self.0.retain(|array| array.0 != name);
        self
    }

    pub(crate) fn text(mut self, name: &str, text: &str) -> Self {
        self.1.push((name.to_owned(), text.to_owned()));
        self
    }

    pub(crate) fn write(&self, path: &Path, method: CompressionMethod) {
        let mut npz = ZipWriter::new(fs::File::create(path).unwrap());
        let options = SimpleFileOptions::default().compression_method(method);
        for (name, shape, values) in &self.0 {
            npz.start_file(format!("{name}.npy"), options).unwrap();
            numbers(&mut npz, shape, values);
        }
        for (name, text) in &self.1 {
            let dtype = format!("<U{}", text.chars().count()).parse().unwrap();
            npz.start_file(format!("{name}.npy"), options).unwrap();
            let writer = WriteOptions::<str>::new().dtype(npyz::DType::new_scalar(dtype));
            let mut writer = writer.shape(&[]).writer(&mut npz).begin_nd().unwrap();
            writer.push(text.as_str()).unwrap();
            writer.finish().unwrap();
        }
        npz.finish().unwrap();
    }

    pub(crate) fn accepted(&self) -> (Trial, Vec<Remark>) {
        let folder = Folder::new();
        let path = folder.path("run.npz");
        self.write(&path, CompressionMethod::Deflated);
        read(&path, &signature()).unwrap_or_else(|error| panic!("{error}"))
    }

    pub(crate) fn refused(&self, parts: &[&str]) {
        let folder = Folder::new();
        let path = folder.path("run.npz");
        self.write(&path, CompressionMethod::Stored);
        refused(&path, parts);
    }
}

pub(crate) fn kinds(remarks: &[Remark]) -> Vec<&RemarkKind> {
    remarks.iter().map(|remark| &remark.kind).collect()
}

pub(crate) const HEADER: &str =
    "time,left,right,gyro[0],gyro[1],quat[0],quat[1],quat[2],quat[3],hip";

/// Rows of the header above at 10 Hz.
pub(crate) fn rows(count: usize) -> String {
    let row = |k: usize| format!("\n{:.1},{k},{},0,0.1,1,0,0,0,0.5", 0.1 * k as f64, 2 * k);
    HEADER.to_owned() + &(0..count).map(row).collect::<String>()
}

/// An npz with one array replaced by raw bytes.
pub(crate) fn with_raw(array: &str, bytes: &[u8]) -> (Folder, PathBuf) {
    use std::io::Write as _;
    let folder = Folder::new();
    let path = folder.path("run.npz");
    let mut npz = ZipWriter::new(fs::File::create(&path).unwrap());
    let options = SimpleFileOptions::default();
    for (name, shape, values) in Arrays::new().without(array).0 {
        npz.start_file(format!("{name}.npy"), options).unwrap();
        numbers(&mut npz, &shape, &values);
    }
    npz.start_file(format!("{array}.npy"), options).unwrap();
    npz.write_all(bytes).unwrap();
    npz.finish().unwrap();
    (folder, path)
}

fn numbers(npz: &mut ZipWriter<fs::File>, shape: &[u64], values: &[f64]) {
    let writer = WriteOptions::<f64>::new().default_dtype().shape(shape);
    let mut writer = writer.writer(npz).begin_nd().unwrap();
    writer.extend(values.iter().copied()).unwrap();
    writer.finish().unwrap();
}

pub(crate) fn npy(header: &str, data: &[u8]) -> Vec<u8> {
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(data);
    bytes
}
