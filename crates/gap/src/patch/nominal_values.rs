//! Fitted nuisance parameters, written into the nominal model.
//!
//! | parameter | form |
//! |---|---|
//! | mass, moments of inertia, centre of mass | `<inertial>`; `gravcomp` keeps its force, in a weightless body where its place would move |
//! | coefficients of the fluid | `fluidcoef` of geoms and classes |
//! | density, viscosity of the box fluid | `option` |
//! | gain of an actuator | as the effect `actuator_gain` |
//! | damping of a joint | `damping`, every term |
//! | a value of an effect | `effects` of `hydro.wrench`, inline |
//! | an axis of a checkpoint's wrench | `wrench_scale` of `hydro.wrench` |
//!
//! They are written before the effects, which add to them. A parameter that the text cannot express stays at its nominal
//! value, and a remark says which one and why.

use hydro_effects::{Entry, Id};
use roxmltree::Node;

use super::{
    PatchError, actuator,
    fluid_coefficients::{self, COEFFICIENTS},
    inertia::{self, InertiaChange},
    instance_values::{self, Value},
    joint,
    mjcf::Mjcf,
    patched::Renumbered,
    writer::Writer,
};
use crate::plant::{Nuisance, PlantBody, PlantJoint, Quantity, factor};

/// Unit of a value known only as a factor.
const FACTOR: &str = "x nominal";

/// Nominal value, written value and unit; or the reason why it was not written.
type WriteResult = Result<(f64, f64, &'static str), String>;

type WriteResults<'r> = Vec<(Number<'r>, WriteResult)>;

/// A parameter that deviates, with its place in the request.
#[derive(Clone, Copy, Debug)]
struct Number<'r> {
    at: usize,
    nuisance: &'r Nuisance,
    value: f64,
}

impl Number<'_> {
    fn factor(&self) -> f64 {
        factor(self.value)
    }

    /// As a factor on the nominal value.
    fn as_factor(&self) -> (f64, f64, &'static str) {
        (1.0, self.factor(), FACTOR)
    }
}

/// Writes every value that deviates from the nominal model.
pub(super) fn write(writer: &mut Writer<'_>) -> Result<(), PatchError> {
    writer.write_nominal_values()
}

impl<'r> Writer<'r> {
    fn write_nominal_values(&mut self) -> Result<(), PatchError> {
        let request = self.request;
        // Before gains are scaled: the compiler's damping is the nominal's.
        let moves = |entry: &Entry| matches!(entry.effect, Id::JointArmature | Id::Payload);
        if request.entries.iter().any(moves) {
            self.keep_what_inertia_tunes()?;
        }
        let (mut turned, mut outcomes) = (Vec::new(), Vec::new());
        for (at, (nuisance, value)) in request.numbers.iter().enumerate() {
            let value = *value;
            let number = Number {
                at,
                nuisance,
                value,
            };
            let is_way = matches!(nuisance.quantity, Quantity::CentreOfMass(_))
                || nuisance.quantity.is_of_log();
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
                Quantity::Damping => self.joint_terms(number, "damping", None)?,
                Quantity::Stiffness(term) => {
                    self.joint_terms(number, "stiffness", Some(term))?
                }
                Quantity::CommandsBefore => Err(
                    "what actuators did before a log began is of the log, not of a model".to_owned(),
                ),
                of if of.is_of_log() => Err(
                    "the time within a step at which commands act and forces are read is no value of a model"
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

    fn tell(&mut self, number: Number<'_>, outcome: WriteResult) {
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
                    Quantity::CommandsBefore => {
                        format!("{:.2} of the first commands", 1.0 + number.value)
                    }
                    of if of.is_of_log() => {
                        format!("{:+.2} steps", number.value)
                    }
                    _ => format!("{:+.2} %", 100.0 * (number.factor() - 1.0)),
                };
                self.remarks.push(format!(
                    "`{name}` stays at its nominal value, though {fitted} was fitted: {reason}"
                ));
            }
        }
    }

    /// Replaces the text by a changed one, or gives the reason why there is none.
    fn rewrite(
        &mut self,
        change: impl FnOnce(&Mjcf<'_>) -> Result<String, String>,
    ) -> Result<Result<(), String>, PatchError> {
        let changed = change(&self.model()?);
        Ok(changed.map(|text| self.text = text))
    }

    /// Inertias body by body, and damping that the compiler derives from inertias.
    fn inertias(&mut self, turned: &[Number<'r>]) -> Result<WriteResults<'r>, PatchError> {
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
        let mut outcomes = WriteResults::new();
        let mut left = numbers;
        while let Some(first) = left.first().copied() {
            let element = first.nuisance.element.as_str();
            let (own, others) = left.into_iter().partition(|number| {
                let number: &Number<'r> = number;
                number.nuisance.element == element
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

    /// All values of one body, or none.
    fn body_inertia(
        &mut self,
        element: &str,
        numbers: Vec<Number<'r>>,
    ) -> Result<WriteResults<'r>, PatchError> {
        let mut turned = InertiaChange::NONE;
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
            .and_then(|node| inertia::change(&model, node, &was, &turned));
        drop(model);
        let written = match written {
            Ok(written) => written,
            Err(reason) => return Ok(refused(numbers, &reason)),
        };
        self.text = written.text;
        if written.moments_were_impossible {
            self.remarks.push(format!(
                "the moments of inertia fitted for `{element}` are impossible (one is greater than the other two \
                 together); the nearest possible ones were written"
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

    /// Keeps the damping that the compiler would derive anew from the changed inertias.
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

    fn coefficients(&mut self, turned: &[Number<'r>]) -> Result<WriteResults<'r>, PatchError> {
        let mut left = chosen(turned, |quantity| coefficient(quantity).is_some());
        let mut outcomes = Vec::new();
        while let Some(first) = left.first() {
            let geom = geom_name(first);
            let (mine, others): (Vec<_>, Vec<_>) = left
                .into_iter()
                .partition(|number| geom_name(number) == geom);
            left = others;
            let mut factors = [1.0; COEFFICIENTS];
            for number in &mine {
                if let Some(place) = coefficient(number.nuisance.quantity) {
                    factors[place] *= number.factor();
                }
            }
            let done = self.rewrite(|model| match geom {
                Some(name) => fluid_coefficients::scale_one(model, name, factors),
                None => fluid_coefficients::scale(model, factors),
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
    ) -> Result<WriteResult, PatchError> {
        let scaled = fluid_coefficients::scale_option(&self.model()?, key, number.factor());
        let Some((text, was, now)) = scaled else {
            return Ok(Err(format!("the text has no `option {key}`")));
        };
        self.text = text;
        Ok(Ok((was, now, unit)))
    }

    fn gain(&mut self, number: Number<'r>) -> Result<WriteResult, PatchError> {
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

    /// A term of damping or stiffness of a joint, or every one.
    fn joint_terms(
        &mut self,
        number: Number<'r>,
        attribute: &'static str,
        term: Option<usize>,
    ) -> Result<WriteResult, PatchError> {
        let element = &number.nuisance.element;
        let joints = &self.request.description.joints;
        let known = joints.iter().find(|joint| joint.name == *element);
        if let Some(known) = known {
            self.keep_tuning(known)?;
        }
        let done = self.rewrite(|model| {
            let node = only("joint", model.joints(), element)?;
            joint::scaled(model, node, attribute, term, number.factor())
                .ok_or_else(|| format!("its {attribute} is not said in the text"))
        })?;
        Ok(done.map(|()| match known {
            None => number.as_factor(),
            Some(known) => {
                let (from, units) = match (attribute, term) {
                    ("damping", _) => (known.damping, ["N s/m", "N m s/rad"]),
                    (_, Some(0)) => (known.stiffness, ["N/m", "N m/rad"]),
                    _ => return number.as_factor(),
                };
                let unit = units[usize::from(!known.scale.slides)];
                (from, from * number.factor(), unit)
            }
        }))
    }

    /// Values of effects, instance by instance.
    fn values(&mut self, turned: &[Number<'r>]) -> Result<WriteResults<'r>, PatchError> {
        let request = self.request;
        let mut outcomes = WriteResults::new();
        let mut left = chosen(turned, |quantity| {
            matches!(quantity, Quantity::EffectValue { .. })
        });
        for (at, body) in request.description.wrench_bodies.iter().enumerate() {
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
                let done = self
                    .rewrite(|model| instance_values::scale_values(model, body, &values, names))?;
                outcomes.extend(factored(own, done));
            }
        }
        outcomes.extend(refused(
            left,
            "the model has no such instance of hydro.wrench",
        ));
        Ok(outcomes)
    }

    fn wrenches(&mut self, turned: &[Number<'r>]) -> Result<WriteResults<'r>, PatchError> {
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
            instance_values::scale_wrench(model, factors).ok_or_else(|| {
                "no instance of hydro.wrench in the text has a checkpoint".to_owned()
            })
        })?;
        Ok(factored(numbers, done))
    }
}

/// Index in `fluidcoef` of a coefficient.
fn coefficient(quantity: Quantity) -> Option<usize> {
    match quantity {
        Quantity::FluidCoefficient(place) | Quantity::GeomCoefficient(place) => Some(place),
        _ => None,
    }
    .filter(|place| *place < COEFFICIENTS)
}

/// The geom of a coefficient; `None` for all geoms.
fn geom_name<'r>(number: &Number<'r>) -> Option<&'r str> {
    let of_one = matches!(number.nuisance.quantity, Quantity::GeomCoefficient(_));
    of_one.then_some(number.nuisance.element.as_str())
}

/// The parameters of a kind.
fn chosen<'r>(turned: &[Number<'r>], kind: impl Fn(Quantity) -> bool) -> Vec<Number<'r>> {
    let of_kind = |number: &&Number<'r>| kind(number.nuisance.quantity);
    turned.iter().filter(of_kind).copied().collect()
}

fn refused<'r>(numbers: Vec<Number<'r>>, reason: &str) -> WriteResults<'r> {
    factored(numbers, Err(reason.to_owned()))
}

/// Parameters that were written together as factors, or not at all.
fn factored<'r>(numbers: Vec<Number<'r>>, done: Result<(), String>) -> WriteResults<'r> {
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
            "the text names no {kind} `{name}` (unnamed, attached or replicated elements have no name in the text)"
        )),
        (Some(_), Some(_)) => Err(format!("the text names several {kind}s `{name}`")),
    }
}
