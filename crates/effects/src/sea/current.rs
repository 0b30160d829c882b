//! Currents: constant, by depth, on a grid in place and time, random in time, and set by a program.

use serde_json::Value;

use super::{
    error::{CURRENT_SCHEMA, SeaError},
    grid::Grid,
    json::{Fields, check, document},
    random::{CURRENT, normal},
};

/// Components of velocity [m/s] and standard deviations; times [s]; depths [m].
const VELOCITIES: [f64; 2] = [-100.0, 100.0];
const DEVIATIONS: [f64; 2] = [0.0, 100.0];
const TIMES: [f64; 2] = [1e-3, 1e7];
const DEPTHS: [f64; 2] = [0.0, 20_000.0];
/// Most points of a profile.
const MOST_POINTS: usize = 1000;
/// Numbers of a random part's state, and of a part that a program sets.
const RANDOM_LEN: usize = 4;
const SET_LEN: usize = 3;

const KEYS: [&str; 6] = [
    "schema", "velocity", "profile", "grid", "random", "settable",
];
const POINT_KEYS: [&str; 2] = ["depth", "velocity"];
const RANDOM_KEYS: [&str; 3] = ["deviation", "time_constant", "seed"];

/// Velocity of the water by place, depth and time, in the world.
///
/// The mean is linear in depth between the points of a profile, or along each axis between the points of a grid, and constant
/// outside. A random part, the same everywhere, may be added: on each axis a first-order Gauss-Markov process with the given standard deviation, whose
/// autocorrelation is exp(-lag / time constant) (G. E. Uhlenbeck and L. S. Ornstein, Physical Review 36, 1930). The
/// caller keeps its state, four numbers: the velocity [m/s] and how many draws were made. The next state is a pure
/// function of seed, state and step, so that a copied or restored state goes on with the same bits.
///
/// A part that a program sets, the same everywhere too, may be added: the last three numbers of the state, a velocity [m/s], zero
/// until it is set.
///
/// The process has no acceleration that a body could feel as pressure; whoever applies it takes the current as steady.
#[derive(Clone, Debug, PartialEq)]
pub struct CurrentField {
    mean: Mean,
    random: Option<Random>,
    is_settable: bool,
}

#[derive(Clone, Debug, PartialEq)]
enum Mean {
    /// Points of ascending depth, one at least.
    Profile(Vec<Point>),
    Grid(Grid),
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Point {
    /// Below the still level [m].
    depth: f64,
    /// In the world [m/s].
    velocity: [f64; 3],
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Random {
    /// Standard deviation on each axis [m/s].
    deviation: [f64; 3],
    /// [s]
    time_constant: f64,
    seed: u64,
}

impl Random {
    /// Numbers with the process's deviations, and the counter after them.
    fn draw(&self, counter: f64) -> ([f64; 3], f64) {
        let noise = normal(self.seed, CURRENT, counter as u64);
        let numbers = [0, 1, 2].map(|axis| self.deviation[axis] * noise[axis]);
        (numbers, counter + 1.0)
    }
}

impl CurrentField {
    /// A current that is the same everywhere and always [m/s].
    ///
    /// # Errors
    /// A number that is not between -100 and 100.
    pub fn uniform(velocity: [f64; 3]) -> Result<Self, SeaError> {
        for (axis, value) in velocity.into_iter().enumerate() {
            check(&format!("velocity[{axis}]"), value, "m/s", VELOCITIES)?;
        }
        Ok(Self {
            mean: uniform(velocity),
            random: None,
            is_settable: false,
        })
    }

    /// Reads and checks a current, `hydro-current/1` ([`crate::sea`]).
    ///
    /// # Errors
    /// The first fault, with its place, what was found and what was expected.
    pub fn parse(text: &str) -> Result<Self, SeaError> {
        let document = document(text, CURRENT_SCHEMA)?;
        let fields = Fields::new("", &document, &KEYS)?;
        let mean = match fields.one_of(["velocity", "profile", "grid"])? {
            "velocity" => uniform(fields.vector("velocity", "m/s", VELOCITIES)?),
            "grid" => Mean::Grid(Grid::read(&document["grid"])?),
            _ => Mean::Profile(profile(fields.list("profile", "points", MOST_POINTS)?)?),
        };
        let random = fields.get("random").map(random).transpose()?;
        Ok(Self {
            mean,
            random,
            is_settable: fields.truth("settable")?.unwrap_or(false),
        })
    }

    /// Mean velocity [m/s] at a place x, y [m], a depth below the still level [m] and a time [s].
    pub fn mean(&self, [x, y]: [f64; 2], depth: f64, time: f64) -> [f64; 3] {
        match &self.mean {
            Mean::Profile(points) => by_depth(points, depth),
            Mean::Grid(grid) => grid.velocity([x, y, depth, time]),
        }
    }

    /// True where a program may set a part of it.
    pub fn is_settable(&self) -> bool {
        self.is_settable
    }

    /// Numbers of state that the caller keeps: four of a random part, then three of a part that a program sets; none without.
    pub fn state_len(&self) -> usize {
        let random = self.random.map_or(0, |_| RANDOM_LEN);
        random + if self.is_settable { SET_LEN } else { 0 }
    }

    /// Sets the state to its start: the random part drawn from the stationary distribution, what a program sets zero. A state of
    /// another length is left alone.
    pub fn reset(&self, state: &mut [f64]) {
        if state.len() != self.state_len() {
            return;
        }
        state.fill(0.0);
        if let (Some(random), [x, y, z, counter, ..]) = (&self.random, state) {
            ([*x, *y, *z], *counter) = random.draw(0.0);
        }
    }

    /// Advances the state by a step [s], exactly in distribution for any step above zero: v exp(-h/T) + deviation
    /// sqrt(1 - exp(-2 h/T)) times a normal number (D. T. Gillespie, Physical Review E 54, 1996). What a program set stays.
    /// Another step, or a state of another length, changes nothing.
    pub fn advance(&self, state: &mut [f64], step: f64) {
        if step.is_nan() || step <= 0.0 {
            return;
        }
        let Some((random, [x, y, z, counter])) = self.started(state) else {
            return;
        };
        let steps = step / random.time_constant;
        let (keep, add) = (libm::exp(-steps), (-libm::expm1(-2.0 * steps)).sqrt());
        let (noise, next) = random.draw(counter);
        let moved = |velocity: f64, noise: f64| keep * velocity + add * noise;
        state[..RANDOM_LEN].copy_from_slice(&[
            moved(x, noise[0]),
            moved(y, noise[1]),
            moved(z, noise[2]),
            next,
        ]);
    }

    /// The random part and its state, as [`CurrentField::reset`] starts it where it is all zero, as a simulation's memory is at first;
    /// `None` where there is no random part, or the state has another length.
    fn started(&self, state: &[f64]) -> Option<(&Random, [f64; RANDOM_LEN])> {
        let random = self.random.as_ref()?;
        let whole = state.len() == self.state_len();
        let mut state: [f64; RANDOM_LEN] = *state.first_chunk().filter(|_| whole)?;
        if state[RANDOM_LEN - 1] == 0.0 {
            let (numbers, counter) = random.draw(0.0);
            state = [numbers[0], numbers[1], numbers[2], counter];
        }
        Some((random, state))
    }

    /// Velocity that a program has set [m/s]; zero in a state of another length, and where it is no velocity.
    fn set(&self, state: &[f64]) -> [f64; SET_LEN] {
        let is_set = self.is_settable && state.len() == self.state_len();
        let set: Option<&[f64; SET_LEN]> = state.last_chunk().filter(|_| is_set);
        let [least, most] = VELOCITIES;
        let is_velocity =
            |set: &&[f64; SET_LEN]| set.iter().all(|value| (least..=most).contains(value));
        set.filter(is_velocity).copied().unwrap_or_default()
    }

    /// Velocity [m/s] at a place x, y [m], a depth below the still level [m] and a time [s], with the random part of a state and
    /// what a program has set; of a state of another length there is neither.
    pub fn velocity(&self, place: [f64; 2], depth: f64, time: f64, state: &[f64]) -> [f64; 3] {
        let mean = self.mean(place, depth, time);
        let random = self.started(state).map_or([0.0; 4], |of| of.1);
        let set = self.set(state);
        [0, 1, 2].map(|axis| mean[axis] + random[axis] + set[axis])
    }
}

fn uniform(velocity: [f64; 3]) -> Mean {
    Mean::Profile(vec![Point {
        depth: 0.0,
        velocity,
    }])
}

/// Velocity [m/s] of a profile at a depth [m].
fn by_depth(profile: &[Point], depth: f64) -> [f64; 3] {
    let below = profile.partition_point(|point| point.depth <= depth);
    let upper = &profile[below.saturating_sub(1)];
    let lower = &profile[below.min(profile.len() - 1)];
    if below == 0 || upper.depth >= lower.depth {
        return upper.velocity;
    }
    let share = (depth - upper.depth) / (lower.depth - upper.depth);
    [0, 1, 2]
        .map(|axis| upper.velocity[axis] + share * (lower.velocity[axis] - upper.velocity[axis]))
}

fn profile(list: &[Value]) -> Result<Vec<Point>, SeaError> {
    let mut points: Vec<Point> = Vec::with_capacity(list.len());
    for (index, value) in list.iter().enumerate() {
        let fields = Fields::new(&format!("profile[{index}]"), value, &POINT_KEYS)?;
        let field = fields.field("depth");
        let depth = check(&field, fields.number("depth", "m")?, "m", DEPTHS)?;
        if let Some(last) = points.last().filter(|last| last.depth >= depth) {
            return Err(SeaError::Value {
                field,
                found: format!("{depth} m after {} m", last.depth),
                expected: "depths that ascend".to_owned(),
            });
        }
        points.push(Point {
            depth,
            velocity: fields.vector("velocity", "m/s", VELOCITIES)?,
        });
    }
    Ok(points)
}

fn random(value: &Value) -> Result<Random, SeaError> {
    let fields = Fields::new("random", value, &RANDOM_KEYS)?;
    let time_constant = fields.number("time_constant", "s")?;
    Ok(Random {
        deviation: fields.vector("deviation", "m/s", DEVIATIONS)?,
        time_constant: check(&fields.field("time_constant"), time_constant, "s", TIMES)?,
        seed: fields.whole("seed")?.unwrap_or(0),
    })
}
