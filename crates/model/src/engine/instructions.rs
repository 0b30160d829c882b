//! The instructions that engines use.

use std::{env, sync::LazyLock};

use pulp::Arch;

use crate::error::ModelError;

/// Environment variable that keeps engines from some of the processor's instructions.
const VARIABLE: &str = "HYDRO_INSTRUCTIONS";

/// Those of this processor; plain ones, or AVX2 of a processor with AVX-512, where the environment asks for them.
///
/// # Errors
/// If the environment asks for others, or for what the processor lacks.
pub(super) fn instructions() -> Result<Arch, ModelError> {
    static ASKED: LazyLock<Option<String>> =
        LazyLock::new(|| env::var_os(VARIABLE).map(|value| value.to_string_lossy().into_owned()));
    chosen(ASKED.as_deref())
}

fn chosen(asked: Option<&str>) -> Result<Arch, ModelError> {
    match asked {
        None | Some("") => Some(Arch::new()),
        Some("portable") => Some(Arch::Scalar),
        #[cfg(target_arch = "x86_64")]
        Some("avx2") => pulp::x86::V3::try_new().map(Arch::V3),
        Some(_) => None,
    }
    .ok_or_else(|| ModelError::Config {
        reason: format!(
            "{VARIABLE} is `{}`, expected `portable`, `avx2` on a processor with it, or nothing",
            asked.unwrap_or_default()
        ),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_environment_can_ask_for_fewer_instructions_and_for_no_others() {
        assert!(matches!(chosen(Some("portable")), Ok(Arch::Scalar)));
        #[cfg(target_arch = "x86_64")]
        assert!(!matches!(
            chosen(Some("avx2")),
            Ok(Arch::V4(_) | Arch::Scalar)
        ));
        for none in [None, Some("")] {
            assert_eq!(
                format!("{:?}", chosen(none).expect("this machine's")),
                format!("{:?}", Arch::new())
            );
        }
        let error = chosen(Some("avx9")).expect_err("no such").to_string();
        assert_eq!(
            error,
            "model configuration: HYDRO_INSTRUCTIONS is `avx9`, expected `portable`, `avx2` on a processor with it, or nothing"
        );
    }
}
