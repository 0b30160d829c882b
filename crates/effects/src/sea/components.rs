//! Sum over the components of a sea at a place and time.

use super::elementary::{exp_of_negative, sin_cos};

/// Components that are computed together.
const LANES: usize = 8;

type Lane = [f64; LANES];

/// One linear wave: elevation = amplitude cos(wavenumber . (x, y) - frequency t + phase).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Component {
    /// Amplitude [m], half the height.
    pub amplitude: f64,
    /// Angular frequency [rad/s].
    pub frequency: f64,
    /// Wave number [rad/m] along world x and y.
    pub wavenumber: [f64; 2],
    /// Phase [rad].
    pub phase: f64,
}

impl Component {
    /// Length of the wave number [rad/m].
    pub fn wavenumber_norm(&self) -> f64 {
        let [x, y] = self.wavenumber;
        (x * x + y * y).sqrt()
    }

    /// Length of the wave [m].
    pub fn length(&self) -> f64 {
        std::f64::consts::TAU / self.wavenumber_norm()
    }
}

/// State of the water at a place and time, in the world.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Kinematics {
    /// Height of the surface above the still level [m].
    pub elevation: f64,
    /// Slope of the surface along x and y [1].
    pub slope: [f64; 2],
    /// Velocity of the water [m/s].
    pub velocity: [f64; 3],
    /// Local acceleration of the water [m/s^2], the rate of the velocity at a fixed place.
    pub acceleration: [f64; 3],
    /// Dynamic pressure by density [m^2/s^2]: the pressure without the still water's, -gravity z.
    pub pressure: f64,
}

/// Numbers of as many components as there are lanes; of no amplitude where there are fewer.
#[derive(Clone, Debug, PartialEq)]
struct Block {
    /// Wave number along x and y, and its length [rad/m].
    along_x: Lane,
    along_y: Lane,
    wavenumber: Lane,
    /// Angular frequency [rad/s] and its inverse.
    frequency: Lane,
    inverse_frequency: Lane,
    phase: Lane,
    amplitude: Lane,
    /// exp(-2 k d), 0 in deep water: all goes with depth as exp(k z) plus or minus this times exp(-k z).
    upward: Lane,
    /// gravity a / (1 + exp(-2 k d)) [m^2/s^2]: the factor of that sum in the dynamic pressure by density.
    pressure: Lane,
}

/// The components of a sea, in blocks.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Components {
    blocks: Vec<Block>,
    /// z of the bed [m], finite.
    bed: f64,
}

impl Components {
    /// Components in water of a depth [m] (infinity: deep), under gravity [m/s^2].
    pub(crate) fn new(components: &[Component], depth: f64, gravity: f64) -> Self {
        let block = |chunk: &[Component]| {
            let lane = |number: &dyn Fn(&Component) -> f64, padding: f64| {
                std::array::from_fn(|index| chunk.get(index).map_or(padding, number))
            };
            let upward = |wave: &Component| libm::exp(-2.0 * wave.wavenumber_norm() * depth);
            Block {
                along_x: lane(&|wave| wave.wavenumber[0], 0.0),
                along_y: lane(&|wave| wave.wavenumber[1], 0.0),
                wavenumber: lane(&Component::wavenumber_norm, 0.0),
                frequency: lane(&|wave| wave.frequency, 1.0),
                inverse_frequency: lane(&|wave| 1.0 / wave.frequency, 1.0),
                phase: lane(&|wave| wave.phase, 0.0),
                amplitude: lane(&|wave| wave.amplitude, 0.0),
                upward: lane(&upward, 0.0),
                pressure: lane(&|wave| gravity * wave.amplitude / (1.0 + upward(wave)), 0.0),
            }
        };
        Self {
            blocks: components.chunks(LANES).map(block).collect(),
            bed: (-depth).max(f64::MIN),
        }
    }

    /// Everything at a place [m] and time [s]. Above the still level all is as at the still level, below the bed as at the
    /// bed.
    pub(crate) fn kinematics(&self, [x, y, z]: [f64; 3], time: f64) -> Kinematics {
        let z = z.clamp(self.bed, 0.0);
        let mut sum = [[0.0; LANES]; 10];
        for block in &self.blocks {
            let (sin, cos) = block.sin_cos(x, y, time);
            let (level, upright) = block.by_depth(z);
            let [elevation, slope_x, slope_y, u, v, w, du, dv, dw, pressure] = &mut sum;
            for lane in 0..LANES {
                let k = [block.along_x[lane], block.along_y[lane]];
                let (level_sin, level_cos) = (level[lane] * sin[lane], level[lane] * cos[lane]);
                let flow = level_cos * block.inverse_frequency[lane];
                let height_sin = block.amplitude[lane] * sin[lane];
                elevation[lane] += block.amplitude[lane] * cos[lane];
                slope_x[lane] -= k[0] * height_sin;
                slope_y[lane] -= k[1] * height_sin;
                u[lane] += k[0] * flow;
                v[lane] += k[1] * flow;
                w[lane] += upright[lane] * sin[lane] * block.inverse_frequency[lane];
                du[lane] += k[0] * level_sin;
                dv[lane] += k[1] * level_sin;
                dw[lane] -= upright[lane] * cos[lane];
                pressure[lane] += level_cos;
            }
        }
        let [elevation, slope_x, slope_y, u, v, w, du, dv, dw, pressure] = sum.map(total);
        Kinematics {
            elevation,
            slope: [slope_x, slope_y],
            velocity: [u, v, w],
            acceleration: [du, dv, dw],
            pressure,
        }
    }

    /// Elevation [m] and slope [1] of the surface, the same bits as those of `kinematics`.
    pub(crate) fn surface(&self, x: f64, y: f64, time: f64) -> (f64, [f64; 2]) {
        let mut sum = [[0.0; LANES]; 3];
        for block in &self.blocks {
            let (sin, cos) = block.sin_cos(x, y, time);
            let [elevation, slope_x, slope_y] = &mut sum;
            for lane in 0..LANES {
                let height_sin = block.amplitude[lane] * sin[lane];
                elevation[lane] += block.amplitude[lane] * cos[lane];
                slope_x[lane] -= block.along_x[lane] * height_sin;
                slope_y[lane] -= block.along_y[lane] * height_sin;
            }
        }
        let [elevation, slope_x, slope_y] = sum.map(total);
        (elevation, [slope_x, slope_y])
    }
}

impl Block {
    /// Sine and cosine of each phase.
    #[inline(always)]
    fn sin_cos(&self, x: f64, y: f64, time: f64) -> (Lane, Lane) {
        let [mut sin, mut cos] = [[0.0; LANES]; 2];
        for lane in 0..LANES {
            let phase = self.phase[lane] - self.frequency[lane] * time;
            let phase = self.along_x[lane] * x + self.along_y[lane] * y + phase;
            (sin[lane], cos[lane]) = sin_cos(phase);
        }
        (sin, cos)
    }

    /// gravity a cosh(k (z + d)) / cosh(k d) and k gravity a sinh(k (z + d)) / cosh(k d), by exponentials that do not overflow.
    #[inline(always)]
    fn by_depth(&self, z: f64) -> (Lane, Lane) {
        let [mut level, mut upright] = [[0.0; LANES]; 2];
        for lane in 0..LANES {
            let down = exp_of_negative(self.wavenumber[lane] * z);
            let up = self.upward[lane] / down;
            level[lane] = self.pressure[lane] * (down + up);
            upright[lane] = self.pressure[lane] * self.wavenumber[lane] * (down - up);
        }
        (level, upright)
    }
}

/// Sum of the lanes, always in the same order.
fn total(lane: Lane) -> f64 {
    let [a, b, c, d, e, f, g, h] = lane;
    ((a + e) + (c + g)) + ((b + f) + (d + h))
}
