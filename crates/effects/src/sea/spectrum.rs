//! A spectrum of wind waves, and components that stand for it.

use std::f64::consts::{PI, TAU};

use super::{
    dispersion::wavenumber,
    error::SeaError,
    json::{check, check_finite},
    quantiles::Quantiles,
    random::{WAVES, uniform},
};

/// Fewest and most components of a spectrum.
pub(crate) const COMPONENTS: [usize; 2] = [20, 1000];
/// Significant heights [m], peak periods [s].
const HEIGHTS: [f64; 2] = [0.0, 100.0];
pub(crate) const PERIODS: [f64; 2] = [0.01, 10_000.0];
/// Peak enhancements: none to three times the usual.
const ENHANCEMENTS: [f64; 2] = [1.0, 10.0];
/// Inverse wave ages: fully developed to the youngest.
const WAVE_AGES: [f64; 2] = [0.84, 5.0];
/// Exponents of the spreading: at 0 all directions are alike, at 1000 their standard deviation is 2.6 degrees.
const SPREADINGS: [f64; 2] = [0.0, 1000.0];
/// Lowest and highest frequency in parts of the peak's. Below there is no energy to a double's last bit; above there is
/// 0.5 % of Pierson's and Moskowitz's, which goes to the rest.
const BAND: [f64; 2] = [0.35, 4.0];
const BAND_CELLS: usize = 8192;
/// Cells of the half circle.
const CIRCLE_CELLS: usize = 8192;
/// Fraction of the golden section: multiples of it, less their whole parts, lie evenly for any count.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// Shape of a spectrum over frequency, S(x) up to a factor, x the frequency in parts of the peak's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SpectrumShape {
    /// x^-5 exp(-5/4 x^-4), the fully developed sea: W. J. Pierson and L. Moskowitz, J. Geophysical Research 69, 1964.
    PiersonMoskowitz,
    /// The same times gamma^exp(-(x - 1)^2 / (2 s^2)), s = 0.07 below the peak and 0.09 above, the growing sea:
    /// K. Hasselmann et al., Deutsche Hydrographische Zeitschrift A8(12), 1973.
    Jonswap {
        /// gamma [1], 1 to 10; 3.3 on average.
        peak_enhancement: f64,
    },
    /// The same times what water of a finite depth lets waves of each length carry, the growing sea near a coast:
    /// E. Bouws, H. Guenther, W. Rosenthal, C. L. Vincent, J. Geophysical Research 90(C1), 1985 (TMA).
    Tma {
        /// gamma [1], 1 to 10.
        peak_enhancement: f64,
    },
    /// x^-4 exp(-5/4 x^-4) exp(-Omega (x - 1) / sqrt 10) gamma^exp(-(x - 1)^2 / (2 s^2)), s = 0.08 (1 + 4 Omega^-3), gamma = 1.7 + 6 lg
    /// max(Omega, 1): the long waves of a unified spectrum, in deep water. T. Elfouhaily, B. Chapron, K. Katsaros, D. Vandemark,
    /// J. Geophysical Research 102(C7), 1997 (ECKV), equations 31, 32 and 3.
    Eckv {
        /// Omega [1], wind speed over the speed of the peak's waves, 0.84 (fully developed) to 5 (young).
        inverse_wave_age: f64,
    },
}

impl SpectrumShape {
    fn density(self, x: f64) -> f64 {
        let inverse = 1.0 / x;
        let fourth = (inverse * inverse) * (inverse * inverse);
        let developed = fourth * inverse * libm::exp(-1.25 * fourth);
        let peaked = |gamma: f64, width: f64| {
            let distance = (x - 1.0) / width;
            libm::exp(libm::exp(-0.5 * distance * distance) * libm::log(gamma))
        };
        match self {
            Self::PiersonMoskowitz => developed,
            Self::Jonswap { peak_enhancement } | Self::Tma { peak_enhancement } => {
                developed * peaked(peak_enhancement, if x <= 1.0 { 0.07 } else { 0.09 })
            }
            Self::Eckv { inverse_wave_age } => {
                let gamma = 1.7 + 6.0 * libm::log10(inverse_wave_age.max(1.0));
                let width = 0.08 * (1.0 + 4.0 * inverse_wave_age.powi(-3));
                let sheltered = libm::exp(-inverse_wave_age * (x - 1.0) / 10.0_f64.sqrt());
                developed * x * sheltered * peaked(gamma, width)
            }
        }
    }
}

/// A spectrum with its size, its directions and its random phases.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spectrum {
    /// Shape over frequency.
    pub shape: SpectrumShape,
    /// Significant height [m], four times the elevation's standard deviation, 0 to 100.
    pub significant_height: f64,
    /// Period of the spectrum's peak [s], 0.01 to 10,000.
    pub peak_period: f64,
    /// Mean direction [rad].
    pub direction: f64,
    /// Exponent s, 0 to 1000, of the spreading cos^2s((direction - mean) / 2) over the whole circle (M. S. Longuet-Higgins,
    /// D. E. Cartwright, N. D. Smith, Ocean Wave Spectra, 1963); all crests are straight without it.
    pub spreading: Option<f64>,
    /// Number of components, 20 to 1000.
    pub components: usize,
    /// Seed of frequencies, directions and phases.
    pub seed: u64,
}

/// A component without its amplitude and wave number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Draw {
    /// Angular frequency [rad/s].
    pub(crate) frequency: f64,
    /// Direction [rad].
    pub(crate) direction: f64,
    /// Phase [rad].
    pub(crate) phase: f64,
}

impl Spectrum {
    fn check(&self) -> Result<(), SeaError> {
        check("significant_height", self.significant_height, "m", HEIGHTS)?;
        check("peak_period", self.peak_period, "s", PERIODS)?;
        check_finite("direction", self.direction)?;
        if let Some(spreading) = self.spreading {
            check("spreading", spreading, "", SPREADINGS)?;
        }
        if let SpectrumShape::Jonswap { peak_enhancement }
        | SpectrumShape::Tma { peak_enhancement } = self.shape
        {
            check("peak_enhancement", peak_enhancement, "", ENHANCEMENTS)?;
        }
        if let SpectrumShape::Eckv { inverse_wave_age } = self.shape {
            check("inverse_wave_age", inverse_wave_age, "", WAVE_AGES)?;
        }
        let [fewest, most] = COMPONENTS;
        if !(fewest..=most).contains(&self.components) {
            return Err(SeaError::Value {
                field: "components".to_owned(),
                found: self.components.to_string(),
                expected: format!(
                    "{fewest} to {most} components of a spectrum, or a list of waves"
                ),
            });
        }
        Ok(())
    }

    /// Amplitude [m] of every component: all carry the same energy, and together that of the significant height.
    pub(crate) fn amplitude(&self) -> f64 {
        0.25 * self.significant_height * (2.0 / self.components as f64).sqrt()
    }

    /// The components, from the lowest frequency to the highest.
    ///
    /// The spectrum is cut into parts of equal energy. Each gives one component, at the frequency below which a random
    /// share of the part lies, with a random phase: frequencies are no multiples of each other, and the sea does not repeat.
    /// Directions are quantiles of the spreading at multiples of the golden section from a random start, so that the
    /// waves of every band of frequencies spread as all do. A frequency has one direction, so that the variance is the
    /// same everywhere (E. R. Jefferys, Applied Ocean Research 9, 1987).
    ///
    /// # Errors
    /// A value that is out of bounds, or TMA's shape in deep water.
    pub(crate) fn draw(&self, depth: f64, gravity: f64) -> Result<Vec<Draw>, SeaError> {
        self.check()?;
        let peak = TAU / self.peak_period;
        let is_limited = matches!(self.shape, SpectrumShape::Tma { .. });
        if is_limited && depth.is_infinite() {
            return Err(SeaError::Value {
                field: "depth".to_owned(),
                found: "none".to_owned(),
                expected: "the depth of the water [m], on which `tma` depends".to_owned(),
            });
        }
        let carried = |x: f64| match is_limited {
            true => saturation(depth * wavenumber(peak * x, depth, gravity)),
            false => 1.0,
        };
        let density = |x| self.shape.density(x) * carried(x);
        let [lower, upper] = BAND;
        let energy = Quantiles::new(lower, upper, BAND_CELLS, density);
        let offsets = self.spreading.map(spreading);
        let [_, _, start, _] = uniform(self.seed, WAVES, 0);
        let draw = |index: usize| {
            let [within, phase, _, _] = uniform(self.seed, WAVES, index as u64);
            let share = (index as f64 + within) / self.components as f64;
            let offset = offsets.as_ref().map_or(0.0, |offsets| {
                let share = start + index as f64 * GOLDEN;
                offset(offsets, share - share.floor())
            });
            Draw {
                frequency: peak * energy.quantile(share),
                direction: self.direction + offset,
                phase: TAU * phase,
            }
        };
        Ok((0..self.components).map(draw).collect())
    }
}

/// Share of the energy in deep water that waves of a frequency have in water of a depth, by wave number times depth:
/// S. A. Kitaigorodskii, V. P. Krasitskii, M. M. Zaslavskii, J. Physical Oceanography 5, 1975.
fn saturation(kd: f64) -> f64 {
    // Beyond 20 it is 1 to the last bit.
    if kd > 20.0 {
        return 1.0;
    }
    let tanh = libm::tanh(kd);
    tanh * tanh / (1.0 + 2.0 * kd / libm::sinh(2.0 * kd))
}

/// Distribution of the angle to the mean direction's right [rad], 0 to pi, by cos^2s of its half.
fn spreading(exponent: f64) -> Quantiles {
    // cos^2s(angle / 2) = exp(s ln((1 + cos angle) / 2)).
    Quantiles::new(0.0, PI, CIRCLE_CELLS, |angle| {
        if exponent == 0.0 {
            return 1.0;
        }
        let half = 0.5 * (1.0 + libm::cos(angle));
        if half > 0.0 {
            libm::exp(exponent * libm::log(half))
        } else {
            0.0
        }
    })
}

/// Angle to the mean direction [rad] below which a share of the energy lies.
fn offset(sides: &Quantiles, share: f64) -> f64 {
    let side = 2.0 * share - 1.0;
    sides.quantile(side.abs()).copysign(side)
}
