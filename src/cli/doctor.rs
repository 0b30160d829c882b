//! `hydro doctor`: the MuJoCo of this program, and a check that the plugin acts in it.

use std::path::PathBuf;

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
    /// This program.
    program: Option<PathBuf>,
    /// The Python package that it came with.
    package: Option<PathBuf>,
    /// The plugin library beside it, for Python and `simulate`.
    plugin_library: Option<PathBuf>,
    /// Version of the headers that the bindings were made from.
    mujoco_headers: Option<&'static str>,
    /// Releases that this build runs in.
    mujoco_accepted: Vec<String>,
    /// The library that this program opens.
    mujoco_library: Option<PathBuf>,
    /// Whether the plugin registers and acts in it.
    plugin: Result<String, String>,
}

/// Runs the command.
pub(super) fn run(args: &Args) -> anyhow::Result<()> {
    let findings = find();
    if args.json {
        return print_json(&findings);
    }
    say!("hydro {}", findings.hydro);
    if let Some(program) = &findings.program {
        say!("program   {}", program.display());
    }
    match &findings.package {
        Some(package) => say!("package   {}", package.display()),
        None => say!("package   none: this program was built by cargo"),
    }
    match &findings.plugin_library {
        Some(library) => say!("plugin    {}", library.display()),
        None => say!("plugin    none: there is no libhydro_plugin.so beside this program"),
    }
    match (findings.mujoco_headers, &findings.mujoco_library) {
        (Some(_), Some(library)) => {
            say!(
                "for       MuJoCo {}",
                findings.mujoco_accepted.join(" and ")
            );
            say!("MuJoCo    {}", library.display());
        }
        _ => say!("built without MuJoCo (feature `mujoco` is off)"),
    }
    match findings.plugin {
        Ok(words) => say!("water     {words}"),
        Err(words) => anyhow::bail!("the plugin does not work here: {words}"),
    }
    Ok(())
}

#[cfg(feature = "mujoco")]
fn find() -> Findings {
    use std::sync::Arc;

    use hydro_plugin::mujoco::{
        VERSION, accepted, library, python_package, register,
        simulator::{Data, Model},
    };

    #[cfg(mujoco_plugins)]
    const PROBE: &str = r#"<mujoco>
        <extension><plugin plugin="hydro.wrench"><instance name="water"><config key="effects" value='{"schema":
        "hydro-effects/1", "effects": [{"effect": "quadratic_drag", "target": "hull", "parameters": {"surge": 10,
        "sway": 10, "heave": 10, "roll": 1, "pitch": 1, "yaw": 1}}]}'/></instance></plugin></extension>
        <worldbody><body name="hull"><freejoint/><geom size=".1"/><plugin plugin="hydro.wrench" instance="water"/></body>
        </worldbody></mujoco>"#;
    #[cfg(not(mujoco_plugins))]
    const PROBE: &str =
        "<mujoco><worldbody><body><freejoint/><geom size='.1'/></body></worldbody></mujoco>";
    /// Speed [m/s] and the drag at it [N].
    const SPEED: f64 = 2.0;
    const DRAG: f64 = -40.0;

    let works = || -> anyhow::Result<String> {
        register()?;
        let mut data = Data::new(&Arc::new(Model::from_xml(PROBE)?))?;
        data.qvel_mut()[0] = SPEED;
        data.forward();
        let force = data.qfrc_passive()[0];
        if cfg!(mujoco_plugins) {
            anyhow::ensure!(
                (force - DRAG).abs() < 1e-9,
                "a drag of {DRAG} N was expected on a test body, {force} N is there"
            );
            return Ok(format!(
                "acts: {force:.1} N of drag on a test body, as expected"
            ));
        }
        Ok("a model compiles".to_owned())
    };
    let program = std::env::current_exe().ok();
    let package = python_package();
    let folder = package.as_deref().or_else(|| program.as_ref()?.parent());
    let plugin_library = folder.map(|folder| folder.join("libhydro_plugin.so"));
    Findings {
        hydro: env!("CARGO_PKG_VERSION"),
        plugin_library: plugin_library.filter(|path| path.is_file()),
        program,
        package,
        mujoco_headers: Some(VERSION),
        mujoco_accepted: accepted(),
        mujoco_library: Some(library()),
        plugin: works().map_err(|error| format!("{error:#}")),
    }
}

#[cfg(not(feature = "mujoco"))]
fn find() -> Findings {
    Findings {
        hydro: env!("CARGO_PKG_VERSION"),
        program: std::env::current_exe().ok(),
        package: None,
        plugin_library: None,
        mujoco_headers: None,
        mujoco_accepted: Vec::new(),
        mujoco_library: None,
        plugin: Ok("not part of this build".to_owned()),
    }
}
