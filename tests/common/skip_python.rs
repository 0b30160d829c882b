//! Tests in Python without a Python.

/// Skips a test that needs `.venv`, and says so; a failure where `HYDRO_REQUIRE_PYTHON` is set, as by `scripts/test.sh`.
pub(crate) fn without_venv() {
    assert!(
        std::env::var_os("HYDRO_REQUIRE_PYTHON").is_none(),
        "no .venv: run scripts/setup.sh"
    );
    eprintln!("skipped: no .venv (scripts/setup.sh makes it)");
}
