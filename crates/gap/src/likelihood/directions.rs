//! Directions along which a candidate effect is looked at: one parameter each, the others held.

use hydro_effects as effects;
use hydro_effects::{Id, Parameter};

use crate::problem::{candidates::FREQUENCY, problem::Problem};

/// Step of a difference quotient, in standard deviations of the prior.
pub(crate) const STEP: f64 = 0.01;
/// The phase of an oscillation, and the rest of a spring.
const PHASE: &str = "phase";
const REST: &str = "reference";

/// A direction of the screen: one parameter of one candidate, with the others at `base`.
#[derive(Clone, Debug)]
pub(crate) struct Direction {
    pub(crate) candidate: usize,
    pub(crate) parameter: usize,
    /// Values of the candidate about which it is looked at.
    pub(crate) base: Vec<f64>,
    /// Step in the parameter's unit.
    pub(crate) step: f64,
}

/// True for a parameter of which two values represent any: amplitudes a quarter turn apart add up to one of any phase, springs
/// with rests apart to one that rests between them. Their directions are one choice.
pub(crate) fn adds_up(id: Id, parameter: &Parameter) -> bool {
    parameter.name == PHASE || is_rest(id, parameter)
}

/// True for the rest of the catalogue's spring; an effect of the user's own may call anything so.
fn is_rest(id: Id, parameter: &Parameter) -> bool {
    id == Id::JointStiffness && parameter.name == REST
}

impl Problem<'_> {
    /// Directions of a candidate: its amplitudes, for several shapes where it has any (a frequency says
    /// nothing while the amplitude is zero, so a few are tried).
    pub(crate) fn directions(&self, candidate: usize) -> Vec<Direction> {
        let options = &self.settings.options.likelihood;
        let of = &self.candidates[candidate];
        let mut bases = vec![of.null()];
        for (at, p) in of.parameters.iter().enumerate() {
            let factors: &[f64] = match p.name.as_str() {
                _ if !p.shapes => continue,
                FREQUENCY => &options.frequency_factors,
                "rate" | "length" => &options.shape_factors,
                _ => continue,
            };
            bases = factors
                .iter()
                .flat_map(|factor| {
                    bases.iter().map(move |base| {
                        let mut base = base.clone();
                        base[at] = (base[at] * factor).clamp(p.lower, p.upper);
                        base
                    })
                })
                .collect();
        }
        let has_places = effects::effect(of.effect).has_places();
        let shapes = |(_, p): &(usize, &Parameter)| p.shapes;
        let all = || of.parameters.iter().enumerate();
        for (at, p) in all().filter(|of| has_places && shapes(of)) {
            for place in options.places {
                let mut base = of.null();
                base[at] += place * p.prior_sd;
                bases.push(base);
            }
        }
        // Several may have met at one bound.
        bases.dedup();
        // Springs at the places add up to one at the usual rest.
        if bases.len() > 1 && of.parameters.iter().any(|p| is_rest(of.effect, p)) {
            bases.remove(0);
        }
        if let Some(at) = of.parameters.iter().position(|p| p.name == PHASE) {
            bases = bases
                .into_iter()
                .flat_map(|base| {
                    let mut quarter = base.clone();
                    quarter[at] += std::f64::consts::FRAC_PI_2;
                    [base, quarter]
                })
                .collect();
        }
        let amplitudes: Vec<(usize, f64)> = all()
            .filter(|of| !shapes(of))
            .map(|(parameter, p)| {
                // A start off the null: there the effect has no derivative, and a secant stands for it.
                let step = if p.start == p.null {
                    inward(p.null, STEP * p.prior_sd, p.upper)
                } else {
                    p.start - p.null
                };
                (parameter, step)
            })
            .collect();
        bases
            .iter()
            .flat_map(|base| {
                amplitudes.iter().map(|(parameter, step)| Direction {
                    candidate,
                    parameter: *parameter,
                    base: base.clone(),
                    step: *step,
                })
            })
            .collect()
    }
}

/// Values of a candidate from the best steps along its directions.
pub(crate) fn values(
    problem: &Problem<'_>,
    candidate: usize,
    found: &[(&Direction, f64)],
) -> Vec<f64> {
    let parameters = &problem.candidates[candidate].parameters;
    let mut values = found.first().map_or_else(
        || problem.candidates[candidate].null(),
        |(direction, _)| direction.base.clone(),
    );
    let value = |direction: &Direction, z: f64| {
        let p = &parameters[direction.parameter];
        (direction.base[direction.parameter] + z * p.prior_sd).clamp(p.lower, p.upper)
    };
    let id = problem.candidates[candidate].effect;
    if let Some(rest) = parameters.iter().position(|p| is_rest(id, p)) {
        let springs = found.iter().map(|(of, z)| (value(of, *z), of.base[rest]));
        if let (Some((first, _)), Some(one)) = (found.first(), one_spring(springs)) {
            let p = &parameters[first.parameter];
            values[first.parameter] = one.0.min(p.upper);
            values[rest] = one.1;
        }
        return values;
    }
    let Some(phase) = parameters.iter().position(|p| p.name == PHASE) else {
        for (direction, z) in found {
            values[direction.parameter] = value(direction, *z);
        }
        return values;
    };
    // Amplitudes at several phases add up to one phasor a component; the strongest sets the phase.
    let mut phasors = vec![(0.0, 0.0); parameters.len()];
    for (direction, z) in found {
        let amplitude = z * parameters[direction.parameter].prior_sd;
        let (sine, cosine) = direction.base[phase].sin_cos();
        let phasor = &mut phasors[direction.parameter];
        phasor.0 += amplitude * cosine;
        phasor.1 += amplitude * sine;
    }
    let strongest = phasors
        .iter()
        .copied()
        .max_by(|a, b| a.0.hypot(a.1).total_cmp(&b.0.hypot(b.1)))
        .unwrap_or((1.0, 0.0));
    let angle = strongest.1.atan2(strongest.0);
    for (direction, _) in found {
        let (real, imaginary) = phasors[direction.parameter];
        let p = &parameters[direction.parameter];
        let along = real * angle.cos() + imaginary * angle.sin();
        values[direction.parameter] = along.clamp(p.lower, p.upper);
    }
    values[phase] = angle;
    values
}

/// Stiffness and rest of the spring that several, each of a stiffness and a rest, are together; `None` of none that pulls.
fn one_spring(springs: impl Iterator<Item = (f64, f64)>) -> Option<(f64, f64)> {
    let (stiffness, moment) = springs.fold((0.0, 0.0), |sum, (stiffness, rest)| {
        (sum.0 + stiffness, sum.1 + stiffness * rest)
    });
    (stiffness > 0.0).then(|| (stiffness, moment / stiffness))
}

/// A step that does not leave the bounds.
pub(crate) fn inward(value: f64, step: f64, upper: f64) -> f64 {
    if value + step > upper { -step } else { step }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn springs_together_pull_as_one() {
        let springs = [(2.0, -0.4), (0.5, 1.0), (0.0, 7.0)];
        let (stiffness, rest) = one_spring(springs.into_iter()).expect("they pull");
        for position in [-1.0, 0.2, 3.0] {
            let all: f64 = springs.iter().map(|(k, at)| k * (position - at)).sum();
            assert!((stiffness * (position - rest) - all).abs() < 1e-12);
        }
        assert_eq!(one_spring([(0.0, 1.0)].into_iter()), None);
    }
}
