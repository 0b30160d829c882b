//! Which effects are tried on which targets.
#![allow(clippy::unwrap_used)]

use super::*;
use crate::{
    plant::{Plant, PlantJoint},
    tests::fake::RigidBody,
};
use hydro_effects::card::JointScale;

const NO_CHANNELS: Channels = Channels {
    list: Vec::new(),
    sources: Vec::new(),
};

/// Slow trials far from walls.
fn usual(model: &PlantDescription) -> Typical {
    Typical {
        speed: vec![0.1; model.nv],
        travel: vec![1.0; model.nq],
        middle: vec![0.0; model.nq],
        lowest: vec![0.0; model.nq],
        highest: vec![0.0; model.nq],
        clearance: f64::INFINITY,
        command: vec![1.0; model.actuators.len()],
    }
}

/// Candidates of a model whose trials are not known.
fn without_trials(
    model: &PlantDescription,
    own: &[Id],
    options: &CandidateOptions,
) -> Vec<Candidate> {
    let medium = (own, None);
    enumerate(model, &NO_CHANNELS, &[], &usual(model), medium, options)
}

fn joint(dof: usize, slides: bool) -> PlantJoint {
    PlantJoint {
        name: format!("joint_{dof}"),
        qpos: dof,
        dof,
        start: 0.0,
        scale: JointScale {
            inertia: 1.0,
            armature: 0.0,
            damping: 0.0,
            torque: 1.0,
            speed: 0.0,
            travel: 0.0,
            middle: 0.0,
            slides,
            driven: true,
        },
        pushes: Vec::new(),
        stiffness: 0.0,
        damping: 0.0,
        is_coordinate: false,
        is_level: false,
    }
}

#[test]
fn the_base_is_the_root_or_a_much_bulkier_body_of_its_tree() {
    let mut model = RigidBody::new().description().clone();
    let hull = model.bodies[0].clone();
    let named = |name: &str, root: bool, part: f64| {
        let mut body = hull.clone();
        (body.name, body.root, body.bulk) = (name.to_owned(), root, part);
        body
    };
    let mut buoyancy = named("hull_buoyancy", false, 3.0);
    buoyancy.wet = false;
    model.bodies = vec![
        named("carriage", true, 0.01),
        named("hull", false, 1.0),
        buoyancy,
        named("fin", false, 0.1),
        named("vehicle", true, 1.0),
        named("arm", false, 1.5),
    ];
    assert_eq!(bases(&model, 2.0), ["hull", "vehicle"]);
}

/// A constant force is tried with a torque and without; entries are whole either way.
#[test]
fn what_is_optional_makes_a_form_of_its_own() {
    let model = RigidBody::new().description().clone();
    let target = Target::Body(model.bodies[0].scale.clone());
    let hull = [("hull".to_owned(), target)];
    let forms = Candidate::forms(Id::ConstantForce, &hull);
    let sizes: Vec<usize> = forms.iter().map(|form| form.parameters.len()).collect();
    assert_eq!(sizes, [3, 6]);
    assert_eq!(
        forms[0].entries(&[1.0, 2.0, 3.0])[0].parameters,
        [1.0, 2.0, 3.0, 0.0, 0.0, 0.0]
    );
    let all = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
    assert_eq!(forms[1].entries(&all)[0].parameters, all);
    assert_eq!(Candidate::forms(Id::Lift, &hull).len(), 1);
}

/// The plugin refuses a deadband wider than what an actuator can be told.
#[test]
fn what_targets_share_lies_within_the_bounds_of_all() {
    let target = |command: f64| {
        Target::Actuator(ActuatorScale {
            command,
            inflow: 0.5,
            step: 0.01,
            thrusts: true,
        })
    };
    let both = [
        ("bow".to_owned(), target(10.0)),
        ("stern".to_owned(), target(0.1)),
    ];
    let shared = &Candidate::forms(Id::ActuatorDeadband, &both)[0];
    let width = &shared.parameters[0];
    assert_eq!(shared.targets, ["bow", "stern"]);
    assert_eq!((width.lower, width.upper), (0.0, 0.1));
    assert!(width.start < 0.01 && width.prior_sd < 0.02, "{width:?}");
}

/// One of the user's own on hinges, and one on a body that is neither base nor wet.
#[test]
fn the_users_own_stand_beside_the_built_in_ones() {
    let own = |name: &str, target: &str, force: &str| {
        let text = format!(
            "summary = \"s\"\ntarget = \"{target}\"\n{force}\n[parameters.k]\nunit = \"N m\"\nlower = -1\n\
             upper = 1\nprior_sd = 1"
        );
        hydro_effects::own::register_toml(name, &text).unwrap()
    };
    let hinge = own("hinge_torque", "hinge", "force = \"k\"");
    let body = own(
        "body_torque",
        "body",
        "targets = [\"tail\"]\nwrench = {yaw = \"k\"}",
    );
    let mut model = RigidBody::new().description().clone();
    model.joints = (0..2).map(|dof| joint(dof, dof == 1)).collect();
    model.bodies.push(PlantBody {
        name: "tail".to_owned(),
        wet: false,
        floats: false,
        root: false,
        ..model.bodies[0].clone()
    });
    let found = |own: &[Id]| {
        let options = CandidateOptions {
            all_bodies: 0,
            ..CandidateOptions::default()
        };
        without_trials(&model, own, &options)
    };
    let all = found(&[hinge, body]);
    let targets = |id: Id| -> Vec<_> {
        let of = all.iter().filter(|of| of.effect == id);
        of.map(|of| of.targets.join(" ")).collect()
    };
    assert_eq!(targets(hinge), ["joint_0"]);
    assert_eq!(targets(body), ["tail"]);
    let without = found(&[]);
    assert_eq!(all.len(), without.len() + 2);
    // Each effect has the same share beforehand.
    let options = CandidateOptions {
        elaborate_form: 0.5,
        ..CandidateOptions::default()
    };
    let share =
        |of: &[Candidate], at: usize| priors(of, (Medium::Water, None), &options)[at].log_share;
    let catalogue = Id::ALL.iter().filter(|id| is_tried(**id)).count() as f64;
    let with_own = catalogue + 2.0;
    assert!((share(&all, all.len() - 1) + with_own.ln()).abs() < 1e-12);
    let more = share(&without, 0) - share(&all, 0);
    assert!((more - (with_own / catalogue).ln()).abs() < 1e-12);
}

/// A payload of a model with many bodies is tried on its base and at the ends of its chains.
#[test]
fn a_payload_may_hang_at_the_end_of_a_chain() {
    let mut model = RigidBody::new().description().clone();
    model.bodies[0].end = false;
    for at in 0..4 {
        model.bodies.push(PlantBody {
            name: format!("link_{at}"),
            root: false,
            end: at == 3,
            bulk: 0.0,
            ..model.bodies[0].clone()
        });
    }
    let bodies = |all_bodies: usize, id: Id| -> Vec<String> {
        let options = CandidateOptions {
            all_bodies,
            ..CandidateOptions::default()
        };
        let all = without_trials(&model, &[], &options);
        let of = all.iter().filter(|of| of.effect == id);
        let mut targets: Vec<String> = of.map(|of| of.targets.join(" ")).collect();
        targets.dedup();
        targets
    };
    assert_eq!(bodies(4, Id::Payload), ["hull", "link_3"]);
    assert_eq!(bodies(4, Id::LinearDrag), ["hull"]);
    assert_eq!(bodies(5, Id::LinearDrag).len(), 5);
    // A hand of more fingers than that carries on its base alone.
    assert_eq!(bodies(0, Id::Payload), ["hull"]);
}

#[test]
fn hinges_and_slides_share_nothing() {
    let mut model = RigidBody::new().description().clone();
    let mut targets = |slides: [bool; 3]| {
        model.joints = (0..3).map(|dof| joint(dof, slides[dof])).collect();
        let all = without_trials(&model, &[], &CandidateOptions::default());
        let dampings = all.into_iter().filter(|of| of.effect == Id::JointDamping);
        let mut targets: Vec<_> = dampings.map(|of| of.targets.join(" ")).collect();
        targets.sort();
        targets
    };
    let alone = ["joint_0", "joint_1", "joint_2"];
    let with = |shared: &'static str| {
        let mut all = [&alone[..], &[shared]].concat();
        all.sort_unstable();
        all
    };
    assert_eq!(targets([false; 3]), with("joint_0 joint_1 joint_2"));
    assert_eq!(targets([true; 3]), with("joint_0 joint_1 joint_2"));
    assert_eq!(targets([false, true, false]), with("joint_0 joint_2"));
    assert_eq!(targets([true, true, false]), with("joint_0 joint_1"));
}

#[test]
fn what_another_holds_already_clashes() {
    let model = RigidBody::new().description().clone();
    let target = Target::Body(model.bodies[0].scale.clone());
    let form = |id: Id, name: &str, at: usize| {
        Candidate::forms(id, &[(name.to_owned(), target.clone())]).swap_remove(at)
    };
    let weight = form(Id::NetBuoyancy, "hull", 0);
    let away = form(Id::NetBuoyancy, "hull", 1);
    let offset = form(Id::BuoyancyOffset, "hull", 0);
    let force = form(Id::ConstantForce, "hull", 0);
    assert!(away.clashes(&offset) && offset.clashes(&away));
    assert!(!weight.clashes(&offset));
    assert!(weight.clashes(&away) && weight.clashes(&force) && force.clashes(&away));
    assert!(!force.clashes(&offset));
    assert!(!away.clashes(&form(Id::BuoyancyOffset, "fin", 0)));
    assert_eq!(weight.mechanism(), away.mechanism());
}

/// A stated medium leaves out what needs a thicker one; one that the model does not tell of needs a reason.
#[test]
fn effects_of_water_need_water() {
    let model = RigidBody::new().description().clone();
    let options = CandidateOptions::default();
    let tried = |medium: Option<Medium>| {
        let typical = usual(&model);
        enumerate(&model, &NO_CHANNELS, &[], &typical, (&[], medium), &options)
    };
    let has = |medium: Medium, id: Id| tried(Some(medium)).iter().any(|of| of.effect == id);
    use Medium::{Air, None, Water};
    for (id, least) in [
        (Id::AddedMass, Water),
        (Id::QuadraticDrag, Air),
        (Id::Payload, None),
    ] {
        for medium in [None, Air, Water] {
            assert_eq!(has(medium, id), medium >= least, "{id} in {medium}");
        }
    }
    let all = tried(Option::None);
    let is_untold = |id: Id, medium: Medium| {
        let at = all.iter().position(|of| of.effect == id).unwrap();
        priors(&all, (medium, Option::None), &options)[at].is_untold
    };
    // Air is everywhere.
    for (medium, of_water) in [(None, true), (Air, true), (Water, false)] {
        assert_eq!(is_untold(Id::AddedMass, medium), of_water, "{medium:?}");
        assert!(!is_untold(Id::QuadraticDrag, medium), "{medium:?}");
    }
    // What every fluid has is expected where the model has none, on the body that it names and in a medium that has it.
    let expected = |medium: Medium, body: Option<&str>| -> Vec<Id> {
        let priors = priors(&all, (medium, body), &options);
        let found = all.iter().zip(priors).filter(|(_, of)| of.is_expected);
        let mut ids: Vec<Id> = found.map(|(of, _)| of.effect).collect();
        ids.dedup();
        ids
    };
    let body = all.iter().find(|of| of.effect == Id::AddedMass).unwrap();
    let body = Some(body.targets[0].as_str());
    assert!(expected(Water, body).contains(&Id::AddedMass));
    assert_eq!(expected(Air, body), [Id::LinearDrag, Id::QuadraticDrag]);
    assert!(expected(None, body).is_empty());
    assert!(expected(Water, Some("another")).is_empty());
    assert!(expected(Water, Option::None).is_empty());
}

/// The hull is 0.6 m long.
#[test]
fn a_body_that_stays_away_does_not_feel_the_surface_nor_a_wall() {
    let mut model = RigidBody::new().description().clone();
    let felt = |model: &PlantDescription, height: f64| {
        let mut typical = usual(model);
        typical.clearance = height.abs();
        typical.lowest[2] = height;
        typical.highest[2] = height;
        let candidates = enumerate(
            model,
            &NO_CHANNELS,
            &[],
            &typical,
            (&[], None),
            &CandidateOptions::default(),
        );
        let tried = |id: Id| candidates.iter().any(|candidate| candidate.effect == id);
        (tried(Id::FreeSurface), tried(Id::WallProximity))
    };
    // As far from a wall as it is deep.
    assert_eq!(felt(&model, -1.1), (true, true));
    assert_eq!(felt(&model, -1.3), (false, false));
    assert_eq!(felt(&model, 1.3), (false, false));
    model.waterline = -0.5;
    assert_eq!(felt(&model, -1.3), (true, false));
    assert_eq!(felt(&model, -1.8), (false, false));
}

/// At one depth the surface is a drag by another name; a wall's distance changes with any way.
#[test]
fn a_body_that_keeps_its_depth_does_not_feel_the_surface() {
    let felt = |model: &PlantDescription, moves: &[usize]| {
        let mut typical = usual(model);
        typical.clearance = 0.0;
        typical.travel = (0..model.nq)
            .map(|at| if moves.contains(&at) { 1.0 } else { 0.0 })
            .collect();
        let (channels, medium) = (&NO_CHANNELS, (&[][..], None));
        let options = &CandidateOptions::default();
        let candidates = enumerate(model, channels, &[], &typical, medium, options);
        let tried = |id: Id| candidates.iter().any(|candidate| candidate.effect == id);
        (tried(Id::FreeSurface), tried(Id::WallProximity))
    };
    let mut model = RigidBody::new().description().clone();
    assert_eq!(felt(&model, &[0, 1]), (false, true));
    assert_eq!(felt(&model, &[2]), (true, true));
    assert_eq!(felt(&model, &[3, 4, 5, 6]), (false, false));
    // On rails.
    model.base = None;
    model.joints = vec![joint(0, true), joint(1, false)];
    assert_eq!(felt(&model, &[0]), (true, true));
    assert_eq!(felt(&model, &[1]), (false, false));
    model.joints[0].is_level = true;
    assert_eq!(felt(&model, &[0, 1]), (false, true));
}

/// A rate is no speed: what swings goes as fast as its far end, what a carriage tows as fast as the carriage.
#[test]
fn speeds_come_from_what_translates() {
    let mut model = RigidBody::new().description().clone();
    let scale = model.bodies[0].scale.clone();
    let typical = Typical {
        speed: vec![3.0, 4.0, 0.0, 0.6, 0.8, 0.0],
        travel: vec![1.0; model.nq],
        middle: vec![0.0; model.nq],
        lowest: vec![0.0; model.nq],
        highest: vec![0.0; model.nq],
        clearance: 0.0,
        command: vec![1.0; model.actuators.len()],
    };
    let found = |model: &PlantDescription| Pace::typical(model, &typical).of_body(&scale, 0.05);
    let close = |(speed, rate): (f64, f64), expected: (f64, f64)| {
        (speed - expected.0).abs() < 1e-9 && (rate - expected.1).abs() < 1e-9
    };
    assert!(close(found(&model), (5.0, 1.0)), "{:?}", found(&model));
    model.base = None;
    // The hull is 0.6 m long.
    model.joints = vec![joint(0, false), joint(1, false)];
    assert!(close(found(&model), (3.0, 5.0)), "{:?}", found(&model));
    model.joints = vec![joint(0, false), joint(4, true)];
    assert!(close(found(&model), (0.8, 0.05)), "{:?}", found(&model));
}

/// A coordinate has no bearing: effects of joints act there where the user's own effect names it alone.
#[test]
fn a_coordinate_of_motion_in_a_plane_has_no_effects_of_joints() {
    let text = "summary = \"s\"\ntarget = \"slide\"\ntargets = [\"joint_1\"]\nforce = \"k\"\n[parameters.k]\nunit = \"N\"\nlower = 0\n\
                upper = 1\nprior_sd = 1";
    let own = hydro_effects::own::register_toml("coordinate_force", text).unwrap();
    let mut model = RigidBody::new().description().clone();
    model.joints = (0..3).map(|dof| joint(dof, dof < 2)).collect();
    model.joints[1].is_coordinate = true;
    model.joints[2].is_coordinate = true;
    let found = without_trials(&model, &[own], &CandidateOptions::default());
    let of_joints =
        |of: &&Candidate| hydro_effects::effect(of.effect).card().target == TargetKind::Joint;
    let (asked, others): (Vec<_>, Vec<_>) = found
        .iter()
        .filter(of_joints)
        .partition(|of| of.effect == own);
    assert!(asked.iter().all(|of| of.targets == ["joint_1"]) && !asked.is_empty());
    assert!(others.iter().all(|of| of.targets == ["joint_0"]) && !others.is_empty());
}

/// Linear drag there is no candidate beside the damping, which no data tell from it, unless there is water.
#[test]
fn drag_of_a_body_that_one_joint_moves_is_damping_of_the_joint() {
    let mut model = RigidBody::new().description().clone();
    model.joints = vec![joint(0, false)];
    let found = |model: &PlantDescription, id: Id| {
        let all = without_trials(model, &[], &CandidateOptions::default());
        all.iter().any(|of| of.effect == id)
    };
    model.has_fluid = false;
    assert!(found(&model, Id::LinearDrag));
    model.bodies[0].only_dof = Some(0);
    assert!(!found(&model, Id::LinearDrag));
    assert!(found(&model, Id::QuadraticDrag) && found(&model, Id::JointDamping));
    model.has_fluid = true;
    assert!(found(&model, Id::LinearDrag));
}

/// A motor without limits on a rail without weight: the trials tell how hard it pushes, and so how large a damping may be.
#[test]
fn a_motor_without_limits_scales_by_what_it_was_told() {
    let mut model = RigidBody::new().description().clone();
    let mut rail = joint(0, true);
    rail.scale.torque = 0.0;
    rail.pushes = vec![(0, 2.0)];
    model.joints.push(rail);
    let damping = |command: f64| {
        let mut typical = usual(&model);
        typical.command[0] = command;
        let medium = (&[][..], None);
        let options = CandidateOptions::default();
        let all = enumerate(&model, &NO_CHANNELS, &[], &typical, medium, &options);
        let damping = all.iter().find(|of| of.effect == Id::JointDamping).unwrap();
        damping.parameters[0].prior_sd
    };
    assert!((damping(100.0) / damping(50.0) - 2.0).abs() < 1e-9);
}

/// Bounds and priors are those of the joint; what is left out stands at its null.
#[test]
fn joints_that_rub_unlike_each_other_have_values_of_their_own() {
    let of_torque = |dof: usize, torque: f64| {
        let mut joint = joint(dof, false);
        joint.scale.torque = torque;
        (joint.name.clone(), Target::Joint(joint.scale))
    };
    let joints = [of_torque(0, 10.0), of_torque(1, 0.5)];
    let apart = Candidate::apart(Id::JointFriction, &joints);
    let alone = joints.each_ref().map(|one| {
        let forms = Candidate::forms(Id::JointFriction, std::slice::from_ref(one));
        forms[0].clone()
    });
    let names: Vec<&str> = apart.parameters.iter().map(|p| p.name.as_str()).collect();
    assert_eq!(names, ["coulomb", "coulomb"]);
    for (own, whole) in alone.iter().zip(&apart.parameters) {
        assert_eq!(
            (own.parameters[0].prior_sd, own.parameters[0].upper),
            (whole.prior_sd, whole.upper)
        );
    }
    assert!(apart.parameters[0].prior_sd > 5.0 * apart.parameters[1].prior_sd);
    for (entry, (own, value)) in apart
        .entries(&[3.0, 0.2])
        .iter()
        .zip(alone.iter().zip([3.0, 0.2]))
    {
        let mut values = own.null();
        values[0] = value;
        assert_eq!(*entry, own.entries(&values)[0]);
    }
    // It stands beside neither of its parts, and is told as on each.
    assert!(alone.iter().all(|of| of.clashes(&apart)));
    let told: Vec<_> = apart
        .mechanisms()
        .map(|(_, targets)| targets.concat())
        .collect();
    assert_eq!(told, ["joint_0", "joint_1"]);
    assert_eq!(apart.targets_of(1), ["joint_1"]);
    // As likely beforehand as on one of them.
    let all = [&alone[..], &[apart]].concat();
    let priors = priors(&all, (Medium::None, None), &CandidateOptions::default());
    assert!(priors.iter().all(|of| of.log_share.is_finite()));
}
