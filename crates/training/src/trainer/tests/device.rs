//! Names of devices, and a build without CUDA.

use super::*;

#[test]
fn names_are_read_back_and_others_refused() {
    for device in [TrainDevice::Cpu, TrainDevice::Cuda(0), TrainDevice::Cuda(3)] {
        assert_eq!(device.to_string().parse(), Ok(device));
    }
    assert_eq!("cuda".parse(), Ok(TrainDevice::Cuda(0)));
    for name in ["gpu", "cuda:", "cuda:x", "cuda:-1", "CPU", ""] {
        let error = name.parse::<TrainDevice>().expect_err("no such device");
        assert_eq!(
            error.to_string(),
            format!("unknown device `{name}`: there are cpu, cuda and cuda:N")
        );
    }
}

#[test]
fn a_build_without_the_feature_says_how_to_get_one() {
    assert!(TrainDevice::Cpu.open().expect("always there").is_cpu());
    if !cuda_is_available() {
        let error = TrainDevice::Cuda(1).open().expect_err("not built in");
        assert_eq!(
            error.to_string(),
            "cuda:1: this build has no CUDA; `cargo build --release --features cuda --target-dir target/cuda` makes one that does"
        );
    }
}
