//! The instructions that engines use.

use std::{env, sync::LazyLock};

use pulp::Arch;

use crate::error::ModelError;

/// Environment variable; its value `portable` keeps engines from the vector unit.
const VARIABLE: &str = "HYDRO_INSTRUCTIONS";
const PORTABLE: &str = "portable";

/// Those of this processor; plain ones where the environment asks for them.
///
/// # Errors
/// If the environment asks for others.
pub(super) fn instructions() -> Result<Arch, ModelError> {
    static ASKED: LazyLock<Option<String>> =
        LazyLock::new(|| env::var_os(VARIABLE).map(|value| value.to_string_lossy().into_owned()));
    chosen(ASKED.as_deref())
}

fn chosen(asked: Option<&str>) -> Result<Arch, ModelError> {
    match asked {
        None | Some("") => Ok(Arch::new()),
        Some(PORTABLE) => Ok(Arch::Scalar),
        Some(other) => Err(ModelError::Config {
            reason: format!("{VARIABLE} is `{other}`, expected `{PORTABLE}` or nothing"),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_environment_can_ask_for_plain_instructions_and_no_others() {
        assert!(matches!(chosen(Some(PORTABLE)), Ok(Arch::Scalar)));
        for none in [None, Some("")] {
            assert_eq!(
                format!("{:?}", chosen(none).expect("this machine's")),
                format!("{:?}", Arch::new())
            );
        }
        let error = chosen(Some("avx9")).expect_err("no such").to_string();
        assert_eq!(
            error,
            "model configuration: HYDRO_INSTRUCTIONS is `avx9`, expected `portable` or nothing"
        );
    }
}
