//! Waves as a field in place and time.

use std::f64::consts::TAU;

use super::{
    components::{Component, Components, Kinematics},
    dispersion::wavenumber,
    error::SeaError,
    json::{check, check_finite},
    limits::{maccamy_fuchs, second_harmonic, steepest},
    note::SeaNote,
    spectrum::{Draw, PERIODS, Spectrum},
};

/// Most listed waves.
pub(crate) const MOST_WAVES: usize = 1000;
/// Amplitudes and depths [m]; greatest gravity [m/s^2].
pub(crate) const AMPLITUDES: [f64; 2] = [0.0, 100.0];
const DEPTHS: [f64; 2] = [0.001, 20_000.0];
const STRONGEST_GRAVITY: f64 = 1000.0;
/// Share of the second harmonic above which there is a note: k a = 0.2 in deep water.
const STEEP: f64 = 0.1;
/// Share of the energy that no one notices.
const UNNOTICED: f64 = 0.01;
/// Diameters in a wave's length below which a hull scatters it: Det Norske Veritas, DNV-RP-C205, on the validity of
/// Morison's formula.
const DIAMETERS: f64 = 5.0;

/// One regular wave to be listed: elevation = amplitude cos(k . x - 2 pi t / period + phase).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wave {
    /// Amplitude [m], half the height, 0 to 100.
    pub amplitude: f64,
    /// Period [s], 0.01 to 10,000.
    pub period: f64,
    /// Direction in which it travels [rad], counterclockwise from world x.
    pub direction: f64,
    /// Phase [rad].
    pub phase: f64,
}

/// The wave that stands for the sea: the highest listed one, or the peak of the spectrum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Peak {
    /// Height [m] of the wave, significant height of the spectrum.
    pub height: f64,
    /// Period [s].
    pub period: f64,
    /// Length [m].
    pub length: f64,
    /// Direction [rad].
    pub direction: f64,
}

/// Linear waves in place and time.
///
/// World frame, z up. A point's z and the elevation are measured from the still level. Above the still level velocity,
/// acceleration and pressure are those at the still level (constant extrapolation, so that crests do not grow with
/// exp(k z)); below the bed those at the bed. At a crest z = elevation the whole pressure is then 0, as it should be;
/// at a trough it is so to the second order.
#[derive(Clone, Debug, PartialEq)]
pub struct WaveField {
    list: Vec<Component>,
    sum: Components,
    depth: f64,
    gravity: f64,
    peak: Peak,
    shortest_length: f64,
}

fn check_water(depth: Option<f64>, gravity: f64) -> Result<f64, SeaError> {
    if !(gravity > 0.0 && gravity <= STRONGEST_GRAVITY) {
        return Err(SeaError::Gravity { found: gravity });
    }
    depth.map_or(Ok(f64::INFINITY), |depth| {
        check("depth", depth, "m", DEPTHS)
    })
}

/// The component of a draw.
fn component(amplitude: f64, draw: &Draw, depth: f64, gravity: f64) -> Component {
    let k = wavenumber(draw.frequency, depth, gravity);
    Component {
        amplitude,
        frequency: draw.frequency,
        wavenumber: [k * libm::cos(draw.direction), k * libm::sin(draw.direction)],
        phase: draw.phase,
    }
}

/// Refuses a wave that would break. `k` is the wave number [rad/m].
fn check_breaking(field: &str, height: f64, k: f64, depth: f64) -> Result<(), SeaError> {
    let (steepness, limit) = (height * k / TAU, steepest(k * depth));
    if steepness <= limit {
        return Ok(());
    }
    Err(SeaError::Breaking {
        field: field.to_owned(),
        height,
        length: TAU / k,
        steepness,
        limit,
    })
}

/// Length [m] of the shortest wave when those are left out which, from the shortest on, carry 1 % of the energy together.
fn shortest_length(list: &[Component]) -> f64 {
    let energy = |wave: &Component| wave.amplitude * wave.amplitude;
    let mut waves: Vec<&Component> = list.iter().filter(|wave| wave.amplitude > 0.0).collect();
    waves.sort_by(|a, b| a.length().total_cmp(&b.length()));
    let all: f64 = waves.iter().copied().map(energy).sum();
    let mut passed = 0.0;
    for wave in waves {
        passed += energy(wave);
        if passed > UNNOTICED * all {
            return wave.length();
        }
    }
    f64::INFINITY
}

impl WaveField {
    /// The sum of 1 to 1000 listed waves in water of a depth [m], 0.001 to 20,000 (none: deep), under gravity [m/s^2], and
    /// what should be known about it.
    ///
    /// # Errors
    /// The first value that is out of bounds, with its place, or the first wave that would break.
    pub fn new(
        waves: &[Wave],
        depth: Option<f64>,
        gravity: f64,
    ) -> Result<(Self, Vec<SeaNote>), SeaError> {
        let depth = check_water(depth, gravity)?;
        if !(1..=MOST_WAVES).contains(&waves.len()) {
            return Err(SeaError::Value {
                field: "components".to_owned(),
                found: format!("{} waves", waves.len()),
                expected: format!("1 to {MOST_WAVES}"),
            });
        }
        let mut list = Vec::with_capacity(waves.len());
        let mut harmonics = 0.0;
        for (index, wave) in waves.iter().enumerate() {
            let field = |name: &str| format!("components[{index}].{name}");
            check(&field("amplitude"), wave.amplitude, "m", AMPLITUDES)?;
            check(&field("period"), wave.period, "s", PERIODS)?;
            check_finite(&field("direction"), wave.direction)?;
            check_finite(&field("phase"), wave.phase)?;
            let draw = Draw {
                frequency: TAU / wave.period,
                direction: wave.direction,
                phase: wave.phase,
            };
            let component = component(wave.amplitude, &draw, depth, gravity);
            let k = component.wavenumber_norm();
            let place = format!("components[{index}]");
            check_breaking(&place, 2.0 * wave.amplitude, k, depth)?;
            harmonics += second_harmonic(k * wave.amplitude, k * depth);
            list.push(component);
        }
        let highest = (0..waves.len())
            .max_by(|&a, &b| {
                waves[a]
                    .amplitude
                    .total_cmp(&waves[b].amplitude)
                    .then(b.cmp(&a))
            })
            .unwrap_or(0);
        let peak = Peak {
            height: 2.0 * waves[highest].amplitude,
            period: waves[highest].period,
            length: list[highest].length(),
            direction: waves[highest].direction,
        };
        Ok(Self::assemble(list, depth, gravity, peak, harmonics))
    }

    /// Waves of a spectrum in water of a depth [m], 0.001 to 20,000 (none: deep), under gravity [m/s^2], and what should be
    /// known about them. The spectrum is that at the place, whatever the depth.
    ///
    /// Four times the standard deviation of the elevation, over all time and at every place, is the significant height to
    /// rounding; over an hour it differs as that of a real sea does. There is nothing above four times the peak's frequency:
    /// the mean period is 1 to 2 % longer, the mean zero-crossing period 3 to 4 %, than those of the uncut spectrum, and with
    /// 60 components they scatter from seed to seed by standard deviations of 0.5 and 1.1 %.
    ///
    /// # Errors
    /// The first value that is out of bounds, or a significant height that would break at the peak's length.
    pub fn from_spectrum(
        spectrum: &Spectrum,
        depth: Option<f64>,
        gravity: f64,
    ) -> Result<(Self, Vec<SeaNote>), SeaError> {
        let depth = check_water(depth, gravity)?;
        let draws = spectrum.draw(depth, gravity)?;
        let height = spectrum.significant_height;
        let k = wavenumber(TAU / spectrum.peak_period, depth, gravity);
        check_breaking("significant_height", height, k, depth)?;
        let amplitude = spectrum.amplitude();
        let list = draws
            .iter()
            .map(|draw| component(amplitude, draw, depth, gravity));
        let list = list.collect();
        let peak = Peak {
            height,
            period: spectrum.peak_period,
            length: TAU / k,
            direction: spectrum.direction,
        };
        let harmonic = second_harmonic(0.5 * k * height, k * depth);
        Ok(Self::assemble(list, depth, gravity, peak, harmonic))
    }

    fn assemble(
        list: Vec<Component>,
        depth: f64,
        gravity: f64,
        peak: Peak,
        second_harmonic: f64,
    ) -> (Self, Vec<SeaNote>) {
        let notes = (second_harmonic > STEEP).then_some(SeaNote::Steep { second_harmonic });
        let field = Self {
            sum: Components::new(&list, depth, gravity),
            shortest_length: shortest_length(&list),
            list,
            depth,
            gravity,
            peak,
        };
        (field, notes.into_iter().collect())
    }

    /// Height of the surface above the still level [m] at x, y [m] and a time [s].
    pub fn elevation(&self, x: f64, y: f64, time: f64) -> f64 {
        self.surface(x, y, time).0
    }

    /// Slope of the surface along x and y [1].
    pub fn slope(&self, x: f64, y: f64, time: f64) -> [f64; 2] {
        self.surface(x, y, time).1
    }

    /// Elevation [m] and slope [1] of the surface in one pass.
    pub fn surface(&self, x: f64, y: f64, time: f64) -> (f64, [f64; 2]) {
        self.sum.surface(x, y, time)
    }

    /// Velocity of the water [m/s] at a point.
    pub fn velocity(&self, point: [f64; 3], time: f64) -> [f64; 3] {
        self.kinematics(point, time).velocity
    }

    /// Local acceleration of the water [m/s^2] at a point.
    pub fn acceleration(&self, point: [f64; 3], time: f64) -> [f64; 3] {
        self.kinematics(point, time).acceleration
    }

    /// Dynamic pressure by density [m^2/s^2] at a point: the whole is density (pressure - gravity z).
    pub fn pressure(&self, point: [f64; 3], time: f64) -> f64 {
        self.kinematics(point, time).pressure
    }

    /// Everything at a point in one pass; the elevation and slope above or below it.
    pub fn kinematics(&self, point: [f64; 3], time: f64) -> Kinematics {
        self.sum.kinematics(point, time)
    }

    /// The components, as listed or from the spectrum's lowest frequency to its highest.
    pub fn components(&self) -> &[Component] {
        &self.list
    }

    /// Depth of the water [m], infinity where it is deep.
    pub fn depth(&self) -> f64 {
        self.depth
    }

    /// Gravity [m/s^2] that the waves were made for.
    pub fn gravity(&self) -> f64 {
        self.gravity
    }

    /// The wave that stands for the sea.
    pub fn peak(&self) -> Peak {
        self.peak
    }

    /// Length [m] of the shortest wave with noticeable energy: the shortest components that carry 1 % of the energy together
    /// are left out. Infinity where all amplitudes are 0.
    pub fn shortest_length(&self) -> f64 {
        self.shortest_length
    }

    /// Significant height [m], four times the standard deviation of the elevation: sqrt(2) of a single wave's height.
    pub fn significant_height(&self) -> f64 {
        let squares: f64 = self
            .list
            .iter()
            .map(|wave| wave.amplitude * wave.amplitude)
            .sum();
        4.0 * (0.5 * squares).sqrt()
    }

    /// Height above the still level [m] that no crest exceeds, and no trough below it: the sum of the amplitudes.
    pub fn highest(&self) -> f64 {
        self.list.iter().map(|wave| wave.amplitude).sum()
    }

    /// A note where a hull of a diameter [m] (its greatest extent across the crests) is longer than a fifth of waves that
    /// carry more than 1 % of the energy.
    pub fn large_hull(&self, diameter: f64) -> Option<SeaNote> {
        if diameter.is_nan() || DIAMETERS * diameter <= self.shortest_length {
            return None;
        }
        let energy = |wave: &Component| wave.amplitude * wave.amplitude;
        let short = self
            .list
            .iter()
            .filter(|wave| wave.length() < DIAMETERS * diameter);
        Some(SeaNote::LargeHull {
            diameter,
            shortest_length: self.shortest_length,
            share: short.map(energy).sum::<f64>() / self.list.iter().map(energy).sum::<f64>(),
            ratio: maccamy_fuchs(diameter, self.shortest_length),
        })
    }
}
