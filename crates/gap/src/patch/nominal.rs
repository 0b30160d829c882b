//! Uncertain numbers of the nominal model, as a fit turned them, written into it.
//!
//! | number | form |
//! |---|---|
//! | mass, moments of inertia, centre of mass | `<inertial>`; `gravcomp`, a force, stays, in a weightless body where its place would move |
//! | coefficients of the fluid | `fluidcoef` of geoms and classes |
//! | density, viscosity of the box fluid | `option` |
//! | gain of an actuator | as the effect `actuator_gain` |
//! | damping of a joint | `damping`, every term |
//! | a value of an effect | `effects` of `hydro.wrench`, inline |
//! | an axis of a checkpoint's wrench | `wrench_scale` of `hydro.wrench` |
//!
//! They come before the effects, which are added to what they make. What cannot be written stays as it
//! is, and a remark says which and why.

use std::fmt;

use roxmltree::Node;

use super::{
    PatchError, Writer, actuator,
    document::Mjcf,
    fluid::{self, COEFFICIENTS},
    inertia::{self, Turned},
    instance::{self, Value},
    joint,
};
use crate::plant::{Nuisance, PlantBody, PlantJoint, Quantity};

/// Unit of a number that is known as a factor alone.
const FACTOR: &str = "x nominal";

/// A number of the nominal model that was written anew.
#[derive(Clone, Debug, PartialEq)]
pub struct Renumbered {
    /// Which of [`Request::numbers`](super::Request::numbers).
    pub number: usize,
    /// Its name: `hull.mass`.
    pub name: String,
    /// Its value in the nominal model.
    pub from: f64,
    /// Its value as written.
    pub to: f64,
    /// Unit of both; `x nominal` where they are parts of what the nominal has.
    pub unit: &'static str,
}

impl fmt::Display for Renumbered {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            name,
            from,
            to,
            unit,
            ..
        } = self;
        let short = |value: &f64| {
            let rounded: f64 = format!("{value:.4e}").parse().unwrap_or(*value);
            super::edit::number(rounded)
        };
        write!(f, "{name} {} -> {} {unit}", short(from), short(to))
    }
}

/// From, to and unit of what was written, or why it was not.
type Outcome = Result<(f64, f64, &'static str), String>;

type Outcomes<'r> = Vec<(Number<'r>, Outcome)>;

/// A turned number by its place in the request.
#[derive(Clone, Copy, Debug)]
struct Number<'r> {
    at: usize,
    nuisance: &'r Nuisance,
    value: f64,
}

impl Number<'_> {
    fn factor(&self) -> f64 {
        1.0 + self.value
    }

    /// As a factor on what the nominal has.
    fn as_factor(&self) -> (f64, f64, &'static str) {
        (1.0, self.factor(), FACTOR)
    }
}

impl<'r> Writer<'r> {
    /// Writes the numbers that are not where the nominal has them.
    pub(super) fn numbers(&mut self) -> Result<(), PatchError> {
        let request = self.request;
        let (mut turned, mut outcomes) = (Vec::new(), Vec::new());
        for (at, (nuisance, value)) in request.numbers.iter().enumerate() {
            let value = *value;
            let number = Number {
                at,
                nuisance,
                value,
            };
            let is_way = matches!(
                nuisance.quantity,
                Quantity::CentreOfMass(_) | Quantity::CommandLead | Quantity::ReadingLead
            );
            if value == 0.0 {
                continue;
            } else if value.is_finite() && (is_way || number.factor() > 0.0) {
                turned.push(number);
            } else {
                let reason = "expected a finite value that leaves more than nothing".to_owned();
                outcomes.push((number, Err(reason)));
            }
        }
        outcomes.extend(self.inertias(&turned)?);
        outcomes.extend(self.coefficients(&turned)?);
        outcomes.extend(self.values(&turned)?);
        outcomes.extend(self.wrenches(&turned)?);
        for number in turned {
            let outcome = match number.nuisance.quantity {
                Quantity::Density => self.option("density", "kg/m^3", number)?,
                Quantity::Viscosity => self.option("viscosity", "Pa s", number)?,
                Quantity::Gain => self.gain(number)?,
                Quantity::Damping => self.damping(number)?,
                Quantity::CommandLead | Quantity::ReadingLead => Err(
                    "when within a step commands act and forces are read is no number of a model"
                        .to_owned(),
                ),
                _ => continue,
            };
            outcomes.push((number, outcome));
        }
        outcomes.sort_by_key(|(number, _)| number.at);
        for (number, outcome) in outcomes {
            self.tell(number, outcome);
        }
        Ok(())
    }

    /// Factor on the mass of a body, as written.
    pub(super) fn mass_factor(&self, body: &str) -> f64 {
        self.mass_factors
            .iter()
            .find(|(name, _)| name == body)
            .map_or(1.0, |(_, factor)| *factor)
    }

    fn tell(&mut self, number: Number<'_>, outcome: Outcome) {
        let name = number.nuisance.name.clone();
        match outcome {
            Ok((from, to, unit)) => self.renumbered.push(Renumbered {
                number: number.at,
                name,
                from,
                to,
                unit,
            }),
            Err(reason) => {
                let fitted = match number.nuisance.quantity {
                    Quantity::CentreOfMass(_) => format!("{:+.4} m", number.value),
                    Quantity::CommandLead | Quantity::ReadingLead => {
                        format!("{:+.2} steps", number.value)
                    }
                    _ => format!("{:+.2} %", 100.0 * number.value),
                };
                self.remarks.push(format!(
                    "`{name}` stays as the nominal has it, though {fitted} was fitted: {reason}"
                ));
            }
        }
    }

    /// Puts a changed text in the place of the one at hand, or says why there is none.
    fn rewrite(
        &mut self,
        change: impl FnOnce(&Mjcf<'_>) -> Result<String, String>,
    ) -> Result<Result<(), String>, PatchError> {
        let changed = change(&self.model()?);
        Ok(changed.map(|text| self.text = text))
    }

    /// Inertias body by body, and what the compiler would make of other inertias.
    fn inertias(&mut self, turned: &[Number<'r>]) -> Result<Outcomes<'r>, PatchError> {
        let numbers = chosen(turned, |quantity| {
            matches!(
                quantity,
                Quantity::Mass | Quantity::Inertia(_) | Quantity::CentreOfMass(_)
            )
        });
        if numbers.is_empty() {
            return Ok(Vec::new());
        }
        if let Some(reason) = inertia::obstacle(&self.model()?) {
            return Ok(refused(numbers, &reason));
        }
        let nominal = self.text.clone();
        self.text = inertia::let_inertials_count(&self.model()?);
        let mut outcomes = Outcomes::new();
        let mut left = numbers;
        while let Some(first) = left.first().copied() {
            let element = first.nuisance.element.as_str();
            let (own, others) = left.into_iter().partition(|number| {
                let of: &Number<'r> = number;
                of.nuisance.element == element
            });
            left = others;
            outcomes.extend(self.body_inertia(element, own)?);
        }
        if outcomes.iter().any(|(_, outcome)| outcome.is_ok()) {
            self.keep_what_inertia_tunes()?;
        } else {
            self.text = nominal;
        }
        Ok(outcomes)
    }

    /// All numbers of one body, or none.
    fn body_inertia(
        &mut self,
        element: &str,
        numbers: Vec<Number<'r>>,
    ) -> Result<Outcomes<'r>, PatchError> {
        let mut turned = Turned::NONE;
        for number in &numbers {
            match number.nuisance.quantity {
                Quantity::Mass => turned.mass *= number.factor(),
                Quantity::Inertia(axis) => turned.moments[axis] *= number.factor(),
                Quantity::CentreOfMass(axis) => turned.way[axis] += number.value,
                _ => {}
            }
        }
        let described = |body: &&PlantBody| body.name == element;
        let Some(body) = self.request.description.bodies.iter().find(described) else {
            return Ok(refused(numbers, "the compiled model has no such body"));
        };
        let was = body.inertial;
        let model = self.model()?;
        let written = only("body", model.bodies(), element)
            .and_then(|node| inertia::turn(&model, node, &was, &turned));
        drop(model);
        let written = match written {
            Ok(written) => written,
            Err(reason) => return Ok(refused(numbers, &reason)),
        };
        self.text = written.text;
        if written.bent {
            self.remarks.push(format!(
                "the moments of inertia fitted for `{element}` are none that a body can have (one is greater \
                 than the other two together); the nearest possible ones were written"
            ));
        }
        self.mass_factors.push((element.to_owned(), turned.mass));
        let outcome = |number: Number<'r>| {
            let found = match number.nuisance.quantity {
                Quantity::Mass => (was.mass, was.mass * turned.mass, "kg"),
                Quantity::Inertia(axis) => (was.moments[axis], written.moments[axis], "kg m^2"),
                Quantity::CentreOfMass(axis) => {
                    let place = was.position[axis];
                    (place, place + turned.way[axis], "m")
                }
                _ => number.as_factor(),
            };
            (number, Ok(found))
        };
        Ok(numbers.into_iter().map(outcome).collect())
    }

    /// Damping that the compiler tunes to inertias stays what it was.
    fn keep_what_inertia_tunes(&mut self) -> Result<(), PatchError> {
        let description = self.request.description;
        for known in &description.actuators {
            let model = self.model()?;
            let kept = only("actuator", model.section("actuator"), &known.name)
                .ok()
                .and_then(|node| actuator::keep_damping(&model, node, known.speed_bias));
            drop(model);
            self.text = kept.unwrap_or_else(|| std::mem::take(&mut self.text));
        }
        for known in &description.joints {
            self.keep_tuning(known)?;
        }
        Ok(())
    }

    fn keep_tuning(&mut self, known: &PlantJoint) -> Result<(), PatchError> {
        let model = self.model()?;
        let kept = only("joint", model.joints(), &known.name)
            .ok()
            .and_then(|node| joint::keep_tuning(&model, node, known.stiffness, known.damping));
        drop(model);
        self.text = kept.unwrap_or_else(|| std::mem::take(&mut self.text));
        Ok(())
    }

    fn coefficients(&mut self, turned: &[Number<'r>]) -> Result<Outcomes<'r>, PatchError> {
        let mut left = chosen(turned, |quantity| coefficient(quantity).is_some());
        let mut outcomes = Vec::new();
        while let Some(first) = left.first() {
            let geom = geom_of(first);
            let (mine, others): (Vec<_>, Vec<_>) =
                left.into_iter().partition(|number| geom_of(number) == geom);
            left = others;
            let mut factors = [1.0; COEFFICIENTS];
            for number in &mine {
                if let Some(place) = coefficient(number.nuisance.quantity) {
                    factors[place] *= number.factor();
                }
            }
            let done = self.rewrite(|model| match geom {
                Some(name) => fluid::scale_one(model, name, factors),
                None => fluid::scale(model, factors),
            })?;
            outcomes.extend(factored(mine, done));
        }
        Ok(outcomes)
    }

    fn option(
        &mut self,
        key: &'static str,
        unit: &'static str,
        number: Number<'r>,
    ) -> Result<Outcome, PatchError> {
        let scaled = fluid::scale_option(&self.model()?, key, number.factor());
        let Some((text, was, now)) = scaled else {
            return Ok(Err(format!("the text has no `option {key}`")));
        };
        self.text = text;
        Ok(Ok((was, now, unit)))
    }

    fn gain(&mut self, number: Number<'r>) -> Result<Outcome, PatchError> {
        let done = self.rewrite(|model| {
            let node = only(
                "actuator",
                model.section("actuator"),
                &number.nuisance.element,
            )?;
            actuator::gain(model, node, number.factor()).ok_or_else(|| {
                let tag = node.tag_name().name();
                format!("<{tag}> has no gain and bias that the text could scale")
            })
        })?;
        Ok(done.map(|()| number.as_factor()))
    }

    fn damping(&mut self, number: Number<'r>) -> Result<Outcome, PatchError> {
        let element = &number.nuisance.element;
        let joints = &self.request.description.joints;
        let known = joints.iter().find(|joint| joint.name == *element);
        if let Some(known) = known {
            self.keep_tuning(known)?;
        }
        let done = self.rewrite(|model| {
            let node = only("joint", model.joints(), element)?;
            joint::scaled_damping(model, node, number.factor())
                .ok_or_else(|| "its damping is not said in the text".to_owned())
        })?;
        Ok(done.map(|()| match known {
            None => number.as_factor(),
            Some(known) => {
                let unit = if known.scale.slides {
                    "N s/m"
                } else {
                    "N m s/rad"
                };
                (known.damping, known.damping * number.factor(), unit)
            }
        }))
    }

    /// Values of effects, carrier by carrier.
    fn values(&mut self, turned: &[Number<'r>]) -> Result<Outcomes<'r>, PatchError> {
        let request = self.request;
        let mut outcomes = Outcomes::new();
        let mut left = chosen(turned, |quantity| {
            matches!(quantity, Quantity::EffectValue { .. })
        });
        for (at, carrier) in request.description.carriers.iter().enumerate() {
            let (own, others): (Vec<_>, Vec<_>) = left.into_iter().partition(|number| {
                matches!(number.nuisance.quantity, Quantity::EffectValue { instance, .. } if instance == at)
            });
            left = others;
            let values: Vec<Value> = own
                .iter()
                .filter_map(|number| match number.nuisance.quantity {
                    Quantity::EffectValue { entry, value, .. } => Some(Value {
                        entry,
                        value,
                        factor: number.factor(),
                    }),
                    _ => None,
                })
                .collect();
            if !values.is_empty() {
                let names = |id, target: &str| (request.names)(request.description, id, target);
                let done =
                    self.rewrite(|model| instance::scale_values(model, carrier, &values, names))?;
                outcomes.extend(factored(own, done));
            }
        }
        outcomes.extend(refused(
            left,
            "the model has no such instance of hydro.wrench",
        ));
        Ok(outcomes)
    }

    fn wrenches(&mut self, turned: &[Number<'r>]) -> Result<Outcomes<'r>, PatchError> {
        let numbers = chosen(
            turned,
            |quantity| matches!(quantity, Quantity::Wrench(axis) if axis < 6),
        );
        let mut factors = [1.0; 6];
        for number in &numbers {
            if let Quantity::Wrench(axis) = number.nuisance.quantity {
                factors[axis] *= number.factor();
            }
        }
        if numbers.is_empty() {
            return Ok(Vec::new());
        }
        let done = self.rewrite(|model| {
            instance::scale_wrench(model, factors).ok_or_else(|| {
                "no instance of hydro.wrench in the text has a checkpoint".to_owned()
            })
        })?;
        Ok(factored(numbers, done))
    }
}

/// Place in `fluidcoef` of a number that is one of it.
fn coefficient(quantity: Quantity) -> Option<usize> {
    match quantity {
        Quantity::FluidCoefficient(place) | Quantity::GeomCoefficient(place) => Some(place),
        _ => None,
    }
    .filter(|place| *place < COEFFICIENTS)
}

/// The geom that a coefficient is of; none: all.
fn geom_of<'r>(number: &Number<'r>) -> Option<&'r str> {
    let of_one = matches!(number.nuisance.quantity, Quantity::GeomCoefficient(_));
    of_one.then_some(number.nuisance.element.as_str())
}

/// The numbers of a kind.
fn chosen<'r>(turned: &[Number<'r>], kind: impl Fn(Quantity) -> bool) -> Vec<Number<'r>> {
    let of_kind = |number: &&Number<'r>| kind(number.nuisance.quantity);
    turned.iter().filter(of_kind).copied().collect()
}

fn refused<'r>(numbers: Vec<Number<'r>>, reason: &str) -> Outcomes<'r> {
    factored(numbers, Err(reason.to_owned()))
}

/// Numbers that were written as factors together, or not at all.
fn factored<'r>(numbers: Vec<Number<'r>>, done: Result<(), String>) -> Outcomes<'r> {
    let outcome = |number: Number<'r>| (number, done.clone().map(|()| number.as_factor()));
    numbers.into_iter().map(outcome).collect()
}

/// The one element of a name.
fn only<'d, 'a>(
    kind: &str,
    elements: impl Iterator<Item = Node<'d, 'a>>,
    name: &str,
) -> Result<Node<'d, 'a>, String> {
    let mut named = elements.filter(|node| node.attribute("name") == Some(name));
    match (named.next(), named.next()) {
        (Some(node), None) => Ok(node),
        (None, _) => Err(format!(
            "the text names no {kind} `{name}` (what is unnamed, attached or replicated it cannot tell)"
        )),
        (Some(_), Some(_)) => Err(format!("the text names several {kind}s `{name}`")),
    }
}
