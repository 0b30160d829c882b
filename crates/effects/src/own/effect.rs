//! A definition as an effect: its card, its parameters, and its programs as a part on a body or a joint.

use nalgebra::{Matrix6, Vector3};
use num_dual::DualSVec64;

use super::{
    check::Range,
    declared::Layout,
    definition::{BODY_OUTPUTS, Definition},
    quantities::{BODY, FAST, JOINT, Kind},
    source::MediumSource,
};
use crate::{
    BodyPart, Card, Effect, Id, JointMotion, JointPart, Medium, Motion, Parameter, Part, Physical,
    Placement, Target, TargetKind,
    card::OwnId,
    catalogue::added_mass::inertia_at,
    dual::{Scalar, constant, cross, sum},
    wrench_law::about_origin,
};

/// A number with six derivatives.
type Dual6 = DualSVec64<6>;

/// One of the user's own effects. Strings that it gives out live as long as the process, as it does itself.
#[derive(Debug)]
pub(crate) struct OwnEffect {
    card: &'static Card,
    /// `None`: nothing is defined, and nothing happens.
    definition: Option<Definition>,
    parameters: Vec<Parameter>,
    text: String,
}

impl OwnEffect {
    /// `text`: the definition as JSON.
    pub(crate) fn new(id: OwnId, definition: Definition, text: String) -> Self {
        let source = &definition.source;
        let own = || format!("the effect `{}` of the user's own", definition.name);
        let card = Card {
            id: Id::Own(id),
            phrase: source.phrase.clone().unwrap_or_else(own).leak(),
            target: match definition.kind {
                Kind::Body => TargetKind::Body,
                Kind::Hinge | Kind::Slide => TargetKind::Joint,
            },
            summary: source.summary.clone().leak(),
            equation: source.equation().leak(),
            source: source
                .source
                .clone()
                .unwrap_or_else(|| "the user's own".to_owned())
                .leak(),
            idealised: source.idealised.unwrap_or(true),
            placement: Placement::Plugin,
        };
        let parameters = definition.parameters.iter();
        let parameters: Vec<Parameter> = parameters
            .map(|of| Parameter {
                name: of.name.clone(),
                unit: of.unit.clone().leak(),
                null: of.null,
                prior_sd: of.prior_sd,
                lower: of.range.lower,
                upper: of.range.upper,
                // Its expressions are checked within these bounds alone.
                physical: Physical::Between(of.range.lower, of.range.upper),
                start: of.null,
                optional: false,
                left_out: None,
                shapes: of.shapes,
            })
            .collect();
        Self {
            card: Box::leak(Box::new(card)),
            parameters,
            definition: Some(definition),
            text,
        }
    }

    /// An effect that does nothing.
    pub(crate) fn idle(id: OwnId) -> Self {
        let card = Card {
            id: Id::Own(id),
            phrase: "an effect that is not defined",
            target: TargetKind::Body,
            summary: "",
            equation: "",
            source: "",
            idealised: false,
            placement: Placement::Plugin,
        };
        Self {
            card: Box::leak(Box::new(card)),
            definition: None,
            parameters: Vec::new(),
            text: String::new(),
        }
    }
}

impl Effect for OwnEffect {
    fn card(&self) -> &'static Card {
        self.card
    }

    fn parameters(&self, target: &Target) -> Vec<Parameter> {
        if self.applies_to(target) {
            self.parameters.clone()
        } else {
            Vec::new()
        }
    }

    fn applies_to(&self, target: &Target) -> bool {
        let kind = self.definition.as_ref().map(|of| of.kind);
        match target {
            Target::Body(_) => kind == Some(Kind::Body),
            Target::Joint(joint) if joint.slides => kind == Some(Kind::Slide),
            Target::Joint(_) => kind == Some(Kind::Hinge),
            Target::Actuator(_) | Target::Sensor(_) => false,
        }
    }

    fn medium(&self) -> Medium {
        let of = self.definition.as_ref().and_then(|of| of.source.medium);
        of.map_or(Medium::None, |MediumSource::Water| Medium::Water)
    }

    fn commands(&self) -> &[String] {
        self.definition.as_ref().map_or(&[], |of| &of.commands)
    }

    fn only_on(&self) -> &[String] {
        self.definition
            .as_ref()
            .map_or(&[], |of| &of.source.targets)
    }

    fn definition(&self) -> Option<&str> {
        Some(&self.text)
    }

    fn part(&self) -> Part<'_> {
        match self.card.target {
            TargetKind::Body => Part::Body(self),
            _ => Part::Joint(self),
        }
    }
}

/// Inputs of a definition's programs, held within their bounds; what is not a number stays so.
fn held<D: Scalar>(value: D, range: Range) -> D {
    if value.re() < range.lower {
        D::from(range.lower)
    } else if value.re() > range.upper {
        D::from(range.upper)
    } else {
        value
    }
}

/// Fills in what follows the quantities of the target.
fn complete<D: Scalar>(
    of: &Definition,
    inputs: &mut Vec<D>,
    commands: &[f64],
    memory: &[f64],
    p: &[D],
) {
    let Layout { len, .. } = of.layout;
    let rest = (0..of.commands.len()).map(|at| commands.get(at).copied().unwrap_or(0.0));
    inputs.extend(rest.map(D::from));
    inputs.push(D::from(memory.first().copied().unwrap_or(0.0)));
    inputs.extend((0..of.parameters.len()).map(|at| p.get(at).copied().unwrap_or(D::from(0.0))));
    inputs.extend(of.constants.iter().map(|value| D::from(*value)));
    debug_assert_eq!(inputs.len(), len);
    for (value, range) in inputs.iter_mut().zip(&of.ranges) {
        *value = held(*value, *range);
    }
}

/// Velocities of a body's origin relative to the water, body frame: linear, angular.
fn velocities<D: Scalar>(motion: &Motion) -> [[D; 3]; 2] {
    // Held before they are turned, so that no product overflows.
    let held = |values: [f64; 3]| constant(values.map(|value| value.clamp(-FAST, FAST)));
    [held(motion.linear), held(motion.angular)]
}

/// Inputs for a body that moves at these velocities.
fn body_inputs<D: Scalar>(
    of: &Definition,
    motion: &Motion,
    [linear, angular]: [[D; 3]; 2],
    memory: &[f64],
    p: &[D],
) -> Vec<D> {
    let rotation = *motion.world_from_base.to_rotation_matrix().matrix();
    let way = rotation * Vector3::from(of.point);
    let velocity = sum(linear, cross(angular, constant(of.point)));
    let mut inputs = Vec::with_capacity(of.layout.len);
    inputs.extend(velocity);
    inputs.extend(angular);
    for axis in 0..3 {
        inputs.push(D::from(motion.position[axis] + way[axis]));
    }
    for axis in 0..3 {
        let row = (0..3).map(|other| velocity[other] * D::from(rotation[(axis, other)]));
        inputs.push(row.fold(D::from(0.0), |sum, term| sum + term));
    }
    for axis in 0..3 {
        inputs.push(D::from(rotation[(2, axis)]));
    }
    // Where the surface is far, it is as far as it can be.
    let depth = motion.depth.map_or(f64::INFINITY, |depth| depth - way.z);
    inputs.extend([depth, motion.time, motion.density].map(D::from));
    debug_assert_eq!(inputs.len(), BODY);
    complete(of, &mut inputs, &motion.commands, memory, p);
    inputs
}

/// Wrench about the origin, body frame.
fn body_wrench<D: Scalar>(
    of: &Definition,
    motion: &Motion,
    velocities: [[D; 3]; 2],
    memory: &[f64],
    p: &[D],
) -> [D; 6] {
    let inputs = body_inputs(of, motion, velocities, memory, p);
    let mut out = [D::from(0.0); BODY_OUTPUTS];
    of.force.run(&inputs, &mut out);
    let rotation = *motion.world_from_base.to_rotation_matrix().matrix();
    let [a, b, c, roll, pitch, yaw, x, y, z] = out;
    let world = [x, y, z];
    let turned = [0, 1, 2].map(|axis| {
        let column = (0..3).map(|other| world[other] * D::from(rotation[(other, axis)]));
        column.fold(D::from(0.0), |sum, term| sum + term)
    });
    about_origin(
        sum([a, b, c], turned),
        [roll, pitch, yaw],
        constant(of.point),
    )
}

/// `z' = (input - z) / time_constant` over a step, exact for an input that is constant over it. A memory that is not a
/// number stays so, and an input that is none leaves it as it is.
fn remember(of: &Definition, inputs: &[f64], step: f64, memory: &mut [f64]) {
    let (Some(program), [z, ..]) = (&of.memory, memory) else {
        return;
    };
    let mut out = [0.0; 2];
    program.run(inputs, &mut out);
    let [input, time] = out;
    let arrived = -(-step.max(0.0) / time).exp_m1();
    let next = *z + arrived * (input - *z);
    if next.is_finite() {
        *z = next;
    }
}

/// Finite slopes; at a kink there may be none.
fn slope(value: f64) -> f64 {
    if value.is_finite() { value } else { 0.0 }
}

impl OwnEffect {
    fn len_of_memory(&self) -> usize {
        usize::from(
            self.definition
                .as_ref()
                .is_some_and(|of| of.memory.is_some()),
        )
    }
}

impl BodyPart for OwnEffect {
    fn memory_len(&self) -> usize {
        self.len_of_memory()
    }

    fn has_inertia(&self) -> bool {
        self.definition
            .as_ref()
            .is_some_and(|of| of.inertia.is_some())
    }

    fn wrench(&self, p: &[f64], motion: &Motion, memory: &[f64]) -> [f64; 6] {
        self.definition.as_ref().map_or([0.0; 6], |of| {
            body_wrench(of, motion, velocities(motion), memory, p)
        })
    }

    fn inertia(&self, p: &[f64], motion: &Motion) -> Option<Matrix6<f64>> {
        let of = self.definition.as_ref()?;
        let program = of.inertia.as_ref()?;
        let mut out = [0.0; 6];
        program.run(
            &body_inputs(of, motion, velocities(motion), &[], p),
            &mut out,
        );
        // Not a number becomes none here.
        let [x, y, z, roll, pitch, yaw] = out.map(|value: f64| slope(value).max(0.0));
        Some(inertia_at([x, y, z], [roll, pitch, yaw], of.point))
    }

    fn damping(&self, p: &[f64], motion: &Motion, memory: &[f64]) -> Option<Matrix6<f64>> {
        let of = self.definition.as_ref()?;
        let [mut linear, mut angular] = velocities::<Dual6>(motion);
        for axis in 0..3 {
            linear[axis] = linear[axis].derivative(axis);
            angular[axis] = angular[axis].derivative(axis + 3);
        }
        let p: Vec<Dual6> = p.iter().map(|value| Dual6::from(*value)).collect();
        let wrench = body_wrench(of, motion, [linear, angular], memory, &p);
        let mut damping = Matrix6::zeros();
        for (row, component) in wrench.iter().enumerate() {
            if let Some(gradient) = &component.eps.0 {
                damping.set_row(row, &-gradient.transpose().map(slope));
            }
        }
        Some(damping)
    }

    fn by_parameters(&self, p: &[f64], motion: &Motion, memory: &[f64]) -> Vec<[f64; 6]> {
        let mut columns = vec![[0.0; 6]; p.len()];
        let Some(of) = &self.definition else {
            return columns;
        };
        for first in (0..p.len()).step_by(6) {
            let mut dual: Vec<Dual6> = p.iter().map(|value| Dual6::from(*value)).collect();
            let here = first..p.len().min(first + 6);
            for index in here.clone() {
                dual[index] = dual[index].derivative(index - first);
            }
            let wrench = body_wrench(of, motion, velocities(motion), memory, &dual);
            for (row, component) in wrench.iter().enumerate() {
                if let Some(gradient) = &component.eps.0 {
                    for index in here.clone() {
                        columns[index][row] = slope(gradient[index - first]);
                    }
                }
            }
        }
        columns
    }

    fn advance(&self, p: &[f64], motion: &Motion, step: f64, memory: &mut [f64]) {
        if let Some(of) = &self.definition {
            let inputs = body_inputs(of, motion, velocities(motion), memory, p);
            remember(of, &inputs, step, memory);
        }
    }
}

/// Inputs for a joint that moves at a velocity.
fn joint_inputs<D: Scalar>(
    of: &Definition,
    motion: &JointMotion,
    velocity: D,
    memory: &[f64],
    p: &[f64],
) -> Vec<D> {
    let mut inputs = Vec::with_capacity(of.layout.len);
    inputs.extend([D::from(motion.position), velocity, D::from(motion.time)]);
    debug_assert_eq!(inputs.len(), JOINT);
    let p: Vec<D> = p.iter().map(|value| D::from(*value)).collect();
    complete(of, &mut inputs, &motion.commands, memory, &p);
    inputs
}

impl JointPart for OwnEffect {
    fn memory_len(&self) -> usize {
        self.len_of_memory()
    }

    fn force(&self, p: &[f64], motion: &JointMotion, memory: &[f64]) -> f64 {
        let mut out = [0.0];
        if let Some(of) = &self.definition {
            of.force.run(
                &joint_inputs(of, motion, motion.velocity, memory, p),
                &mut out,
            );
        }
        out[0]
    }

    fn damping(&self, p: &[f64], motion: &JointMotion, memory: &[f64]) -> f64 {
        let velocity = Dual6::from(motion.velocity).derivative(0);
        let mut out = [Dual6::from(0.0)];
        if let Some(of) = &self.definition {
            of.force
                .run(&joint_inputs(of, motion, velocity, memory, p), &mut out);
        }
        out[0].eps.0.map_or(0.0, |gradient| slope(-gradient[0]))
    }

    fn advance(&self, p: &[f64], motion: &JointMotion, step: f64, memory: &mut [f64]) {
        if let Some(of) = &self.definition {
            let inputs = joint_inputs(of, motion, motion.velocity, memory, p);
            remember(of, &inputs, step, memory);
        }
    }
}
