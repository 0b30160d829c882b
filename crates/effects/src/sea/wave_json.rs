//! Waves from JSON.

use serde_json::Value;

use super::{
    error::{SeaError, WAVES_SCHEMA},
    json::{Fields, check, document, fault},
    note::SeaNote,
    spectrum::{Spectrum, SpectrumShape},
    wave_field::{AMPLITUDES, MOST_WAVES, Wave, WaveField},
};
use crate::did_you_mean::hint;

const LIST_KEYS: [&str; 3] = ["schema", "depth", "components"];
const SPECTRUM_KEYS: [&str; 11] = [
    "schema",
    "depth",
    "spectrum",
    "significant_height",
    "peak_period",
    "direction",
    "spreading",
    "peak_enhancement",
    "inverse_wave_age",
    "components",
    "seed",
];
const WAVE_KEYS: [&str; 5] = ["height", "amplitude", "period", "direction", "phase"];
const PIERSON_MOSKOWITZ: &str = "pierson_moskowitz";
const JONSWAP: &str = "jonswap";
const TMA: &str = "tma";
const ECKV: &str = "eckv";
/// Names of the spectra, for messages.
const SPECTRA: &str = "`jonswap`, `tma`, `eckv` or `pierson_moskowitz`";
/// Defaults of a file that leaves them out.
const PEAK_ENHANCEMENT: f64 = 3.3;
const INVERSE_WAVE_AGE: f64 = 0.84;
const COMPONENTS: u64 = 60;
const SEED: u64 = 0;

impl WaveField {
    /// Reads and checks waves, `hydro-waves/1` ([`crate::sea`]), under gravity [m/s^2], the size of the pull along -z. Comes
    /// with what should be known about them.
    ///
    /// # Errors
    /// The first fault, with its place, what was found and what was expected.
    pub fn parse(text: &str, gravity: f64) -> Result<(Self, Vec<SeaNote>), SeaError> {
        let document = document(text, WAVES_SCHEMA)?;
        if document.get("spectrum").is_some() {
            let fields = Fields::new("", &document, &SPECTRUM_KEYS)?;
            let depth = fields.optional("depth", "m")?;
            return Self::from_spectrum(&spectrum(&fields)?, depth, gravity);
        }
        if !document.get("components").is_some_and(Value::is_array) {
            // Without a list it is a spectrum without its name, if anything.
            let expected = format!("a spectrum, {SPECTRA}, or a list `components`");
            Fields::new("", &document, &SPECTRUM_KEYS)?.required("spectrum", &expected)?;
        }
        let fields = Fields::new("", &document, &LIST_KEYS)?;
        let depth = fields.optional("depth", "m")?;
        let list = fields.list("components", "waves", MOST_WAVES)?;
        let waves = list.iter().enumerate().map(wave);
        Self::new(&waves.collect::<Result<Vec<_>, _>>()?, depth, gravity)
    }
}

fn wave((index, value): (usize, &Value)) -> Result<Wave, SeaError> {
    let fields = Fields::new(&format!("components[{index}]"), value, &WAVE_KEYS)?;
    let angle = |key| Ok(fields.optional(key, "degrees")?.unwrap_or(0.0).to_radians());
    let amplitude = match fields.one_of(["height", "amplitude"])? {
        "height" => {
            let heights = AMPLITUDES.map(|amplitude| 2.0 * amplitude);
            0.5 * check(
                &fields.field("height"),
                fields.number("height", "m")?,
                "m",
                heights,
            )?
        }
        amplitude => fields.number(amplitude, "m")?,
    };
    Ok(Wave {
        amplitude,
        period: fields.number("period", "s")?,
        direction: angle("direction")?,
        phase: angle("phase")?,
    })
}

fn spectrum(fields: &Fields<'_>) -> Result<Spectrum, SeaError> {
    let names = [JONSWAP, TMA, ECKV, PIERSON_MOSKOWITZ];
    let value = fields.required("spectrum", SPECTRA)?;
    let name = value
        .as_str()
        .ok_or_else(|| fault("spectrum", value, SPECTRA))?;
    let (enhancement, age) = (
        fields.optional("peak_enhancement", "")?,
        fields.optional("inverse_wave_age", "")?,
    );
    let only = |field: &str, with: &str, given: Option<f64>| match given {
        None => Ok(()),
        Some(_) => Err(SeaError::Value {
            field: field.to_owned(),
            found: format!("it with `{name}`"),
            expected: format!("it with {with} only"),
        }),
    };
    if ![JONSWAP, TMA].contains(&name) && names.contains(&name) {
        only("peak_enhancement", "`jonswap` or `tma`", enhancement)?;
    }
    if name != ECKV && names.contains(&name) {
        only("inverse_wave_age", "`eckv`", age)?;
    }
    let peak_enhancement = enhancement.unwrap_or(PEAK_ENHANCEMENT);
    let shape = match name {
        JONSWAP => SpectrumShape::Jonswap { peak_enhancement },
        TMA => SpectrumShape::Tma { peak_enhancement },
        ECKV => SpectrumShape::Eckv {
            inverse_wave_age: age.unwrap_or(INVERSE_WAVE_AGE),
        },
        PIERSON_MOSKOWITZ => SpectrumShape::PiersonMoskowitz,
        _ => {
            return Err(SeaError::UnknownSpectrum {
                found: name.chars().take(60).collect(),
                hint: hint(name, names),
                known: names.to_vec(),
            });
        }
    };
    Ok(Spectrum {
        shape,
        significant_height: fields.number("significant_height", "m")?,
        peak_period: fields.number("peak_period", "s")?,
        direction: fields
            .optional("direction", "degrees")?
            .unwrap_or(0.0)
            .to_radians(),
        spreading: fields.optional("spreading", "")?,
        components: usize::try_from(fields.whole("components")?.unwrap_or(COMPONENTS))
            .unwrap_or(usize::MAX),
        seed: fields.whole("seed")?.unwrap_or(SEED),
    })
}
