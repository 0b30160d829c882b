//! The uncertain numbers of a nominal model, and how they are changed in a copy of it.
//!
//! | class | what | change |
//! |---|---|---|
//! | mass | bodies with more than a thousandth of their tree | relative; buoyancy given as gravity compensation, a force, stays |
//! | inertia | principal moments of those bodies | relative |
//! | centre of mass | of those bodies, along the body's axes | metres; buoyancy stays at the nominal's place |
//! | fluid | coefficients of MuJoCo's ellipsoid model, each kind for all geoms; density and viscosity of its box model; values of the nominal's `effects`; the force of a checkpoint by axis | relative |
//! | gain | actuators | relative, gain and bias alike |
//! | damping | joints that have any | relative |
//! | stiffness | joints that have any, term by term | relative |
//! | timing | all commands | steps by which they act earlier |
//! | timing | forces read inside a step | part of the jump at the step's end that they show already |
//! | start | all commands | change of the part of a trial's first commands that memories are led through before its log |

use hydro_effects::{Entry, Medium, Part, TargetKind, effect};
use hydro_gap::plant::{self, Nuisance, NuisanceClass, Quantity};

use super::description::is_weighed;
#[cfg(mujoco_outputs)]
use crate::mujoco::ffi::views::NPOLY;
use crate::{
    mujoco::{
        effects::{bind, sizes, surroundings::Surroundings},
        ffi::{
            ModelView,
            bindings::{
                mjBIAS_AFFINE, mjBIAS_NONE, mjGAIN_AFFINE, mjGAIN_FIXED, mjModel, mjOBJ_ACTUATOR,
                mjOBJ_BODY, mjOBJ_GEOM, mjOBJ_JOINT, mjSTAGE_ACC,
            },
            views::{NBIAS, NGAIN, actuators, view_mut},
        },
        simulator::{Model, SimulatorError},
    },
    plugin::{Settings, native_fluid::EllipsoidCoefficients},
};

/// An instance of `hydro.wrench` in the nominal model.
#[derive(Clone, Debug)]
pub(crate) struct Nominal {
    pub(crate) id: usize,
    pub(crate) settings: Settings,
    /// The water around it.
    pub(crate) around: Surroundings,
    pub(crate) effects: Vec<Entry>,
}

impl Nominal {
    /// True where it stands for water: a checkpoint, or an effect of water.
    pub(crate) fn is_wet(&self) -> bool {
        let of_water = |entry: &Entry| effect(entry.effect).medium() == Medium::Water;
        self.settings.checkpoint.is_some() || self.effects.iter().any(of_water)
    }

    /// True where its water moves in a way that changes.
    pub(crate) fn moves_water(&self) -> bool {
        let of_water = |entry: &Entry| matches!(effect(entry.effect).part(), Part::Water(_));
        self.around.sea.moves() || self.effects.iter().any(of_water)
    }
}

/// A nuisance parameter that is not at zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Turn {
    pub(crate) quantity: Quantity,
    /// Number of the body, geom, joint or actuator, where it is of one.
    pub(crate) id: usize,
    /// Change: relative, or in metres.
    pub(crate) value: f64,
}

/// Numbers of `fluidcoef`.
const COEFFICIENTS: [&str; 5] = [
    "blunt_drag",
    "slender_drag",
    "angular_drag",
    "kutta_lift",
    "magnus_lift",
];

/// Up to this many ellipsoids each have coefficients of their own; those of more change together.
const APART: usize = 6;

/// Column of `geom_fluid` where these start.
const COEFFICIENT: usize = 1;

const AXES: [&str; 3] = ["x", "y", "z"];

const WRENCH: [&str; 6] = [
    "force.x", "force.y", "force.z", "torque.x", "torque.y", "torque.z",
];

/// All nuisance parameters of a model, whose `hydro.wrench` instances have these settings, each with the number of the
/// body, geom, joint or actuator that it is of.
pub(crate) fn find(model: ModelView<'_>, nominal: &[Nominal]) -> Vec<(Nuisance, usize)> {
    let mut nuisances = Vec::new();
    let mut add = |name: String, element: &str, class, quantity, id| {
        let nuisance = Nuisance {
            name,
            element: element.to_owned(),
            class,
            quantity,
        };
        nuisances.push((nuisance, id));
    };
    for body in 1..model.bodies() {
        let moves = sizes::has_inertia(model, body);
        if !(moves || is_weighed(model, body)) {
            continue;
        }
        let of = model.label(mjOBJ_BODY as i32, "body", body);
        let name = format!("{of}.mass");
        add(name, &of, NuisanceClass::Mass, Quantity::Mass, body);
        for (axis, axis_name) in AXES.iter().enumerate() {
            if moves {
                let name = format!("{of}.inertia.{axis_name}");
                let quantity = Quantity::Inertia(axis);
                add(name, &of, NuisanceClass::Inertia, quantity, body);
            }
            let name = format!("{of}.com.{axis_name}");
            let quantity = Quantity::CentreOfMass(axis);
            add(name, &of, NuisanceClass::CentreOfMass, quantity, body);
        }
    }
    if model.has_fluid() {
        let wet: Vec<usize> = (0..model.geom_type().len())
            .filter(|geom| sizes::is_ellipsoid(model, *geom))
            .collect();
        if !wet.is_empty() {
            let used = |geom: usize, place: usize| {
                let row = EllipsoidCoefficients::LEN * geom;
                model.geom_fluid()[row + COEFFICIENT + place] != 0.0
            };
            let name_of = |geom: usize| model.name(mjOBJ_GEOM as i32, geom);
            let apart = wet.len() <= APART && wet.iter().all(|geom| !name_of(*geom).is_empty());
            for (place, name) in COEFFICIENTS.iter().enumerate() {
                let here = wet.iter().filter(|geom| used(**geom, place));
                if apart {
                    for geom in here {
                        let of = name_of(*geom);
                        let name = format!("{of}.{name}");
                        let quantity = Quantity::GeomCoefficient(place);
                        add(name, &of, NuisanceClass::Fluid, quantity, *geom);
                    }
                } else if here.count() > 0 {
                    let name = format!("fluid.{name}");
                    let quantity = Quantity::FluidCoefficient(place);
                    add(name, "fluid", NuisanceClass::Fluid, quantity, 0);
                }
            }
        } else {
            let option = &model.raw().opt;
            for (value, name, quantity) in [
                (option.density, "density", Quantity::Density),
                (option.viscosity, "viscosity", Quantity::Viscosity),
            ] {
                if value > 0.0 {
                    let name = format!("fluid.{name}");
                    add(name, "fluid", NuisanceClass::Fluid, quantity, 0);
                }
            }
        }
    }
    for (instance, of) in nominal.iter().enumerate() {
        for (at, listed) in of.effects.iter().enumerate() {
            let card = effect(listed.effect).card();
            let class = match card.target {
                TargetKind::Joint => NuisanceClass::Damping,
                TargetKind::Actuator => NuisanceClass::Gain,
                _ => NuisanceClass::Fluid,
            };
            let density = sizes::density(model, of.around.density);
            let found = bind::target(model, card.target, &listed.target);
            let names = found.map_or_else(
                |_| Vec::new(),
                |found| effect(listed.effect).parameters(&found.sizes(model, density, None)),
            );
            for (value, parameter) in names.iter().enumerate() {
                if listed
                    .parameters
                    .get(value)
                    .is_some_and(|value| *value != 0.0)
                {
                    let name = format!("{}.{}.{}", listed.target, listed.effect, parameter.name);
                    let quantity = Quantity::EffectValue {
                        instance,
                        entry: at,
                        value,
                    };
                    add(name, &listed.target, class, quantity, 0);
                }
            }
        }
    }
    if nominal.iter().any(|of| of.settings.checkpoint.is_some()) {
        for (axis, name) in WRENCH.iter().enumerate() {
            let (name, quantity) = (format!("water.{name}"), Quantity::Wrench(axis));
            add(name, "water", NuisanceClass::Fluid, quantity, 0);
        }
    }
    for id in 0..model.actuator_trntype().len() {
        let (gain, bias) = (
            model.actuator_gaintype()[id] as u32,
            model.actuator_biastype()[id] as u32,
        );
        if (gain == mjGAIN_FIXED || gain == mjGAIN_AFFINE)
            && (bias == mjBIAS_NONE || bias == mjBIAS_AFFINE)
        {
            let of = model.label(mjOBJ_ACTUATOR as i32, "actuator", id);
            let name = format!("{of}.gain");
            add(name, &of, NuisanceClass::Gain, Quantity::Gain, id);
        }
    }
    for joint in 0..model.jnt_type().len() {
        let dof = model.jnt_dofadr()[joint] as usize;
        if model.dof_damping()[dof] > 0.0 {
            let of = model.label(mjOBJ_JOINT as i32, "joint", joint);
            let name = format!("{of}.damping");
            add(name, &of, NuisanceClass::Damping, Quantity::Damping, joint);
        }
        for (term, value) in sizes::stiffness(model, joint).into_iter().enumerate() {
            if value != 0.0 {
                let of = model.label(mjOBJ_JOINT as i32, "joint", joint);
                let name = match term {
                    0 => format!("{of}.stiffness"),
                    term => format!("{of}.stiffness.{term}"),
                };
                let quantity = Quantity::Stiffness(term);
                add(name, &of, NuisanceClass::Stiffness, quantity, joint);
            }
        }
    }
    let has_forces = model.sensor_needstage().contains(&(mjSTAGE_ACC as i32));
    if model.raw().nu > 0 {
        let mut lead = |of: &str, quantity| {
            add(format!("{of}.lead"), of, NuisanceClass::Timing, quantity, 0);
        };
        lead("commands", Quantity::CommandLead);
        if has_forces {
            lead("forces", Quantity::ReadingLead);
        }
        add(
            "commands.before".to_owned(),
            "commands.before",
            NuisanceClass::Start,
            Quantity::CommandsBefore,
            0,
        );
    }
    add(
        "positions.lag".to_owned(),
        "positions",
        NuisanceClass::Timing,
        Quantity::PositionLag,
        0,
    );
    add(
        "velocities.lag".to_owned(),
        "velocities",
        NuisanceClass::Timing,
        Quantity::VelocityLag,
        0,
    );
    if has_forces {
        add(
            "forces.lag".to_owned(),
            "forces",
            NuisanceClass::Timing,
            Quantity::ForceLag,
            0,
        );
    }
    nuisances
}

/// Changed nuisance parameters that are no part of the model.
#[derive(Debug, Default)]
pub(crate) struct Beside {
    pub(crate) wrench_scale: Option<[f64; 6]>,
    /// Effects of the nominal's instances (place in the list), where any was changed.
    pub(crate) effects: Vec<(usize, Vec<Entry>)>,
    /// See `ActiveEffects`.
    pub(crate) moved_centres: Vec<(usize, [f64; 3], f64)>,
    /// Steps by which commands act early.
    pub(crate) command_lead: f64,
    /// Change of the part of the first commands that memories are led through before a log.
    pub(crate) commands_before: f64,
    /// Part of a step's last jump that forces show inside it.
    pub(crate) reading_lead: f64,
}

/// True where a nuisance parameter is a number of the model itself.
pub(crate) fn is_of_model(quantity: Quantity) -> bool {
    let is_value = !matches!(quantity, Quantity::Wrench(_) | Quantity::EffectValue { .. });
    is_value && !quantity.is_of_log()
}

/// Turns nuisance parameters that are no part of the model.
pub(crate) fn turn_beside(turned: &[Turn], nominal: &[Nominal]) -> Beside {
    let mut beside = Beside::default();
    for turn in turned {
        let factor = plant::factor(turn.value);
        match turn.quantity {
            Quantity::CommandLead => beside.command_lead += turn.value,
            Quantity::CommandsBefore => beside.commands_before += turn.value,
            Quantity::ReadingLead => beside.reading_lead += turn.value,
            Quantity::Wrench(axis) => {
                beside.wrench_scale.get_or_insert([1.0; 6])[axis] *= factor;
            }
            Quantity::EffectValue {
                instance,
                entry,
                value,
            } => {
                let of = &nominal[instance];
                let at = beside
                    .effects
                    .iter()
                    .position(|(known, _)| *known == instance);
                let at = at.unwrap_or_else(|| {
                    beside.effects.push((instance, of.effects.clone()));
                    beside.effects.len() - 1
                });
                beside.effects[at].1[entry].parameters[value] *= factor;
            }
            _ => {}
        }
    }
    beside
}

/// Turns nuisance parameters of a model, and makes what depends on them right.
pub(crate) fn turn(
    model: &mut Model,
    turned: &[Turn],
    beside: &mut Beside,
) -> Result<(), SimulatorError> {
    let mut inertial = false;
    for turn in turned {
        let Turn {
            quantity,
            id,
            value,
        } = *turn;
        let factor = plant::factor(value);
        match quantity {
            Quantity::Mass => {
                let raw = model.raw_mut();
                // SAFETY: one number a body, and the model is held alone.
                let (mass, compensation) = unsafe {
                    (
                        view_mut(raw.body_mass, raw.nbody),
                        view_mut(raw.body_gravcomp, raw.nbody),
                    )
                };
                mass[id] *= factor;
                // Compensation counts in weights of the body; the force stays.
                compensation[id] /= factor;
                inertial = true;
            }
            Quantity::Inertia(axis) => {
                let raw = model.raw_mut();
                // SAFETY: three numbers a body, and the model is held alone.
                let inertia = unsafe { view_mut(raw.body_inertia, raw.nbody * 3) };
                inertia[3 * id + axis] *= factor;
                inertial = true;
            }
            Quantity::CentreOfMass(axis) => {
                move_centre(model.raw_mut(), id, axis, value);
                let way = beside.moved_centres.iter().position(|(of, ..)| *of == id);
                let at = way.unwrap_or_else(|| {
                    beside.moved_centres.push((id, [0.0; 3], 0.0));
                    beside.moved_centres.len() - 1
                });
                beside.moved_centres[at].1[axis] += value;
                inertial = true;
            }
            Quantity::FluidCoefficient(place) | Quantity::GeomCoefficient(place) => {
                let one = matches!(quantity, Quantity::GeomCoefficient(_));
                let raw = model.raw_mut();
                // SAFETY: a row of twelve a geom, and the model is held alone.
                let rows = unsafe {
                    view_mut(
                        raw.geom_fluid,
                        raw.ngeom * EllipsoidCoefficients::LEN as i64,
                    )
                };
                let rows = rows.chunks_exact_mut(EllipsoidCoefficients::LEN);
                for (_, row) in rows.enumerate().filter(|(geom, _)| !one || *geom == id) {
                    row[COEFFICIENT + place] *= factor;
                }
            }
            Quantity::Density => model.raw_mut().opt.density *= factor,
            Quantity::Viscosity => model.raw_mut().opt.viscosity *= factor,
            Quantity::Gain => scale_gain(model, id, factor),
            Quantity::Damping => scale_damping(model.raw_mut(), id, factor),
            Quantity::Stiffness(term) => scale_stiffness(model.raw_mut(), id, term, factor),
            Quantity::Wrench(_)
            | Quantity::EffectValue { .. }
            | Quantity::CommandLead
            | Quantity::CommandsBefore
            | Quantity::ReadingLead
            | Quantity::PositionLag
            | Quantity::VelocityLag
            | Quantity::ForceLag => {}
        }
    }
    if inertial {
        model.set_constants()?;
    }
    let view = model.view();
    beside.moved_centres.retain_mut(|(body, _, buoyancy)| {
        *buoyancy = view.body_gravcomp()[*body] * view.body_mass()[*body];
        *buoyancy != 0.0
    });
    Ok(())
}

/// Scales gain and bias of an actuator: what it gives, before limits of the force.
pub(crate) fn scale_gain(model: &mut Model, actuator: usize, factor: f64) {
    let raw = model.raw_mut();
    let count = actuators(raw);
    // SAFETY: a row an actuator, and the model is held alone.
    let (gain, bias) = unsafe {
        (
            view_mut(raw.actuator_gainprm, count * NGAIN as i64),
            view_mut(raw.actuator_biasprm, count * NBIAS as i64),
        )
    };
    gain[NGAIN * actuator..][..3]
        .iter_mut()
        .chain(&mut bias[NBIAS * actuator..][..3])
        .for_each(|value| *value *= factor);
}

fn scale_stiffness(raw: &mut mjModel, joint: usize, term: usize, factor: f64) {
    // SAFETY: one number a joint, and the model is held alone.
    let linear = unsafe { view_mut(raw.jnt_stiffness, raw.njnt) };
    match term.checked_sub(1) {
        None => linear[joint] *= factor,
        #[cfg(mujoco_outputs)]
        Some(higher) => {
            // SAFETY: a row a joint, and the model is held alone.
            let all = unsafe { view_mut(raw.jnt_stiffnesspoly, raw.njnt * NPOLY as i64) };
            all[NPOLY * joint + higher] *= factor;
        }
        #[cfg(not(mujoco_outputs))]
        Some(_) => {}
    }
}

fn scale_damping(raw: &mut mjModel, joint: usize, factor: f64) {
    // SAFETY: one number a joint or degree of freedom, and the model is held alone.
    let (first, of, damping) = unsafe {
        (
            view_mut(raw.jnt_dofadr, raw.njnt)[joint] as usize,
            view_mut(raw.dof_jntid, raw.nv),
            view_mut(raw.dof_damping, raw.nv),
        )
    };
    let dofs = (first..of.len()).take_while(|dof| of[*dof] as usize == joint);
    for dof in dofs.clone() {
        damping[dof] *= factor;
    }
    #[cfg(mujoco_outputs)]
    {
        // SAFETY: a row a degree of freedom, and the model is held alone.
        let higher = unsafe { view_mut(raw.dof_dampingpoly, raw.nv * NPOLY as i64) };
        for dof in dofs {
            higher[NPOLY * dof..NPOLY * (dof + 1)]
                .iter_mut()
                .for_each(|value| *value *= factor);
        }
    }
}

/// Moves a centre of mass [m] along an axis of the body, and takes back the compiler's notes on which
/// frames coincide with that of the inertia.
fn move_centre(raw: &mut mjModel, body: usize, axis: usize, way: f64) {
    use crate::mujoco::ffi::bindings::{
        mjSAMEFRAME_INERTIA, mjSAMEFRAME_INERTIAROT, mjSAMEFRAME_NONE,
    };
    let none = mjSAMEFRAME_NONE as u8;
    // SAFETY: arrays of these lengths, and the model is held alone.
    unsafe {
        view_mut(raw.body_ipos, raw.nbody * 3)[3 * body + axis] += way;
        view_mut(raw.body_sameframe, raw.nbody)[body] = none;
        let of = view_mut(raw.geom_bodyid, raw.ngeom);
        let geoms = view_mut(raw.geom_sameframe, raw.ngeom);
        let of_site = view_mut(raw.site_bodyid, raw.nsite);
        let sites = view_mut(raw.site_sameframe, raw.nsite);
        for (of, flags) in [(of, geoms), (of_site, sites)] {
            for (of, flag) in of.iter().zip(flags) {
                let inertial = [mjSAMEFRAME_INERTIA, mjSAMEFRAME_INERTIAROT];
                if *of as usize == body && inertial.contains(&u32::from(*flag)) {
                    *flag = none;
                }
            }
        }
    }
}
