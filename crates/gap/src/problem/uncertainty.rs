//! Uncertainty of the nominal model: `nominal.toml`.
//!
//! ```toml
//! mass = 0.03      # relative standard deviations by class
//! inertia = 0.03
//! com_m = 0.005    # of each coordinate of a centre of mass [m]
//! fluid = 0.03
//! gain = 0.03
//! gain_by_trial = 0.02   # of all actuators together, from trial to trial
//! damping = 0.03
//! stiffness = 0.03
//!
//! [elements]       # by element of the MJCF, or by a single nuisance parameter
//! hull = 0.01
//! "thruster_1.gain" = 0.1
//! ```

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::{
    error::GapError,
    options::CandidateOptions,
    plant::{Nuisance, NuisanceClass, Quantity},
};

/// Standard deviations of the nominal model's numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Uncertainty {
    /// Masses, relative.
    pub mass: f64,
    /// Moments of inertia, relative.
    pub inertia: f64,
    /// Coordinates of centres of mass [m].
    pub com_m: f64,
    /// Coefficients of the nominal's fluid, relative.
    pub fluid: f64,
    /// Actuator gains, relative.
    pub gain: f64,
    /// The factor on the gains of all actuators that differs from trial to trial (a battery), relative. Gains that are known
    /// exactly have none.
    pub gain_by_trial: f64,
    /// Joint damping, relative.
    pub damping: f64,
    /// Terms of joint stiffness, relative.
    pub stiffness: f64,
    /// Standard deviations by element of the MJCF or by nuisance parameter; they override the classes.
    pub elements: BTreeMap<String, f64>,
}

impl Default for Uncertainty {
    fn default() -> Self {
        Self {
            mass: 0.03,
            inertia: 0.03,
            com_m: 0.005,
            fluid: 0.03,
            gain: 0.03,
            gain_by_trial: 0.02,
            damping: 0.03,
            stiffness: 0.03,
            elements: BTreeMap::new(),
        }
    }
}

impl Uncertainty {
    /// From the text of a `nominal.toml`.
    ///
    /// # Errors
    /// A key that does not exist (with those that do), or a value that is no standard deviation.
    pub fn parse(text: &str, nuisances: &[Nuisance]) -> Result<Self, GapError> {
        let read: Self =
            toml::from_str(text).map_err(|fault| GapError::Uncertainty(place(text, &fault)))?;
        let classes = [
            ("mass", read.mass),
            ("inertia", read.inertia),
            ("com_m", read.com_m),
            ("fluid", read.fluid),
            ("gain", read.gain),
            ("gain_by_trial", read.gain_by_trial),
            ("damping", read.damping),
            ("stiffness", read.stiffness),
        ];
        let elements = read.elements.iter().map(|(key, sd)| (key.as_str(), *sd));
        for (key, sd) in classes.into_iter().chain(elements) {
            if !(sd.is_finite() && sd >= 0.0) {
                return Err(GapError::Uncertainty(format!(
                    "`{key}` is {sd}; expected a standard deviation, zero or more"
                )));
            }
        }
        let is_said = |key: &str| {
            text.parse::<toml::Table>()
                .is_ok_and(|of| of.contains_key(key))
        };
        if read.gain == 0.0 && read.gain_by_trial > 0.0 && is_said("gain_by_trial") {
            return Err(GapError::Uncertainty(
                "`gain_by_trial` is above zero, yet `gain = 0` says that gains are known exactly; give `gain` a small \
                 standard deviation, such as 0.001"
                    .to_owned(),
            ));
        }
        for key in read.elements.keys() {
            if !nuisances
                .iter()
                .any(|nuisance| nuisance.element == *key || nuisance.name == *key)
            {
                let mut exists: Vec<&str> = nuisances
                    .iter()
                    .flat_map(|nuisance| [nuisance.element.as_str(), nuisance.name.as_str()])
                    .collect();
                exists.sort_unstable();
                exists.dedup();
                return Err(GapError::Uncertainty(format!(
                    "[elements] names `{key}`, which the model does not have; it has: {}",
                    exists.join(", ")
                )));
            }
        }
        Ok(read)
    }

    /// Standard deviation of a nuisance parameter, in the nuisance parameter's own unit.
    pub fn standard_deviation(&self, nuisance: &Nuisance, options: &CandidateOptions) -> f64 {
        let named = self
            .elements
            .get(&nuisance.name)
            .or_else(|| self.elements.get(&nuisance.element));
        named.copied().unwrap_or(match nuisance.class {
            NuisanceClass::Mass => self.mass,
            NuisanceClass::Inertia => self.inertia,
            NuisanceClass::CentreOfMass => self.com_m,
            NuisanceClass::Fluid => self.fluid,
            NuisanceClass::Gain => self.gain,
            NuisanceClass::Damping => self.damping,
            NuisanceClass::Stiffness => self.stiffness,
            NuisanceClass::Timing if nuisance.quantity == Quantity::CommandLead => {
                options.command_lead_sd
            }
            NuisanceClass::Timing => options.reading_lead_sd,
            NuisanceClass::Start => options.commands_before_sd,
        })
    }
}
/// Characters of a line of the table in a message.
const LONGEST_LINE: usize = 80;

/// A fault of a table on one line: where it is, and what.
fn place(text: &str, fault: &toml::de::Error) -> String {
    let before = fault.span().and_then(|span| text.get(..span.start));
    let row = before.map_or(0, |before| before.matches('\n').count());
    let line = hydro_files::one_line(text.lines().nth(row).unwrap_or(""), LONGEST_LINE);
    format!(
        "line {} (`{line}`): {}",
        row + 1,
        hydro_files::short(fault.message())
    )
}
