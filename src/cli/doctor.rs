//! `hydro doctor`: the MuJoCo of this build, and a check that the plugin loads in it.

use super::output::print_json;

/// Flags of `hydro doctor`.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Print one JSON value and nothing else.
    #[arg(long)]
    json: bool,
}

/// The findings.
#[derive(Debug, serde::Serialize)]
struct Findings {
    hydro: &'static str,
    /// Version of the headers that the bindings were made from.
    mujoco_headers: Option<&'static str>,
    /// The library that was found when building.
    mujoco_library: Option<&'static str>,
    /// Whether the plugin registers and runs in it.
    plugin: Result<String, String>,
}

/// Runs the command.
pub(super) fn run(args: &Args) -> anyhow::Result<()> {
    let findings = find();
    if args.json {
        return print_json(&findings);
    }
    say!("hydro {}", findings.hydro);
    match (findings.mujoco_headers, findings.mujoco_library) {
        (Some(version), Some(library)) => {
            say!("built for MuJoCo {version}\nlibrary   {library}")
        }
        _ => say!("built without MuJoCo (feature `mujoco` is off)"),
    }
    match findings.plugin {
        Ok(words) => say!("plugin    {words}"),
        Err(words) => anyhow::bail!("the plugin does not work here: {words}"),
    }
    Ok(())
}

#[cfg(feature = "mujoco")]
fn find() -> Findings {
    use hydro_plugin::mujoco::LIBRARY;
    use hydro_plugin::mujoco::{VERSION, register, simulator::Model};

    const PROBE: &str =
        "<mujoco><worldbody><body><freejoint/><geom size='.1'/></body></worldbody></mujoco>";
    let works = || -> anyhow::Result<String> {
        register()?;
        Model::from_xml(PROBE)?;
        Ok("hydro.wrench and hydro.load_cell are registered; a model compiles".to_owned())
    };
    Findings {
        hydro: env!("CARGO_PKG_VERSION"),
        mujoco_headers: Some(VERSION),
        mujoco_library: Some(LIBRARY),
        plugin: works().map_err(|error| format!("{error:#}")),
    }
}

#[cfg(not(feature = "mujoco"))]
fn find() -> Findings {
    Findings {
        hydro: env!("CARGO_PKG_VERSION"),
        mujoco_headers: None,
        mujoco_library: None,
        plugin: Ok("not part of this build".to_owned()),
    }
}
