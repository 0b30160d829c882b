//! Refusals of the user's own effects, one each; effects against closed forms; programs against a plain evaluation of trees.

use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;

use super::{
    bytecode::Program,
    check::{Facts, Known, Range, facts},
    expression::{Binary, Expression, Kind, Meaning, Node, Unary},
    register_json, register_toml,
    units::Dimension,
};
use crate::{
    BodyPart, Effect, EffectSet, Entry, Id, JointMotion, JointPart, Medium, Motion, OwnError, Part,
    effect,
    tests::fixture::{Model, any_motion, still},
};

/// A spring and a drag between a point of the body and an anchor in the world.
pub(crate) const TETHER: &str = r#"
summary = "a line to an anchor: slack below its length, then a spring; drag of the line along the way"
phrase = "a tether"
target = "body"
point = [-0.4, 0.0, 0.1]

[parameters.stiffness]
unit = "N/m"
lower = 0.0
upper = 500.0
prior_sd = 20.0

[parameters.length]
unit = "m"
null = 2.0
lower = 0.5
upper = 10.0
prior_sd = 1.0

[parameters.drag]
unit = "N s^2/m^2"
lower = 0.0
upper = 100.0
prior_sd = 5.0

[constants.anchor_z]
value = -3.0
unit = "m"

[constants.shortest]
value = 0.05
unit = "m"

[let]
away_z = "z - anchor_z"
distance = "max(norm(x, y, away_z), shortest)"
pull = "stiffness * max(distance - length, 0) / distance"
speed = "norm(v_x, v_y, v_z)"

[world_force]
x = "-pull * x - drag * speed * v_x"
y = "-pull * y - drag * speed * v_y"
z = "-pull * away_z - drag * speed * v_z"
"#;

/// A hinge that is dragged by water with a memory.
const LAGGING: &str = r#"
summary = "a lagging drag"
target = "hinge"
force = "-amount * memory * abs(memory) - offset * port"
[commands]
port = "thruster_1"
[parameters.amount]
unit = "N m s^2/rad^2"
lower = 0
upper = 10
prior_sd = 1
[parameters.offset]
unit = "N m"
lower = -1
upper = 1
prior_sd = 0.1
[parameters.tau]
unit = "s"
null = 0.5
lower = 0.1
upper = 5
prior_sd = 0.5
[memory]
input = "qdot"
time_constant = "tau"
"#;

/// The smallest definition, with these lines in the place of the wrench's.
fn small(wrench: &str) -> String {
    format!(
        "summary = \"s\"\ntarget = \"body\"\n[parameters.k]\nunit = \"N\"\nlower = -1\nupper = 2\nprior_sd = 1\n{wrench}"
    )
}

fn fault(text: &str) -> String {
    match register_toml("bad", text) {
        Ok(_) => panic!("it should be refused: {text}"),
        Err(error) => error.to_string(),
    }
}

/// What is said of a surge force.
fn surge(expression: &str) -> String {
    fault(&small(&format!("[wrench]\nsurge = \"{expression}\"\n")))
}

fn own(name: &str, text: &str) -> &'static dyn Effect {
    effect(register_toml(name, text).expect("a definition"))
}

fn body(effect: &'static dyn Effect) -> &'static dyn BodyPart {
    match effect.part() {
        Part::Body(part) => part,
        _ => panic!("not on a body"),
    }
}

fn joint(effect: &'static dyn Effect) -> &'static dyn JointPart {
    match effect.part() {
        Part::Joint(part) => part,
        _ => panic!("not on a joint"),
    }
}

#[test]
fn a_wrong_name_is_refused_with_the_nearest() {
    let text = surge("k * nu_surg / nu_surge");
    assert!(
        text.contains("[wrench] surge: there is no `nu_surg`; did you mean `nu_surge`?"),
        "{text}"
    );
    assert!(
        text.contains("depth") && text.contains("tanh") && !text.contains("memory"),
        "{text}"
    );
    assert!(surge("k * tan(up_x)").contains("did you mean `atan`?"));
    assert!(surge("k * nu_dot_surge").contains("give its coefficient in [inertia]"));
    // A quantity of another target.
    assert!(surge("k * qdot").contains("there is no `qdot`"));
}

/// An effect of the water fades where the hull is above it; a joint has no hull.
#[test]
fn an_effect_may_be_of_the_water() {
    let of = |text: &str| {
        let id = register_toml("splash", text)?;
        Ok::<_, OwnError>(effect(id).medium())
    };
    let drag = small("[wrench]\nsurge = \"k\"\n");
    assert_eq!(of(&drag), Ok(Medium::None));
    let wet = drag.replacen("target", "medium = \"water\"\ntarget", 1);
    assert_eq!(of(&wet), Ok(Medium::Water));
    let text = fault(&wet.replace("\"water\"", "\"mud\""));
    assert!(
        text.contains("unknown variant `mud`, expected `water`"),
        "{text}"
    );
    let joint = wet.replace("target = \"body\"", "target = \"hinge\"");
    let joint =
        joint
            .replace("[wrench]\nsurge = \"k\"", "")
            .replacen("target", "force = \"k\"\ntarget", 1);
    assert!(
        fault(&joint).contains("`medium` is of a body"),
        "{}",
        fault(&joint)
    );
}

#[test]
fn a_wrong_unit_is_refused() {
    let wrong = small("[wrench]\nsurge = \"k\"\n").replace("\"N\"", "\"deg\"");
    assert!(
        fault(&wrong).contains("[parameters.k]: unit `deg`: `deg` is not known; angles are in rad")
    );
    let text = surge("k * nu_surge");
    assert!(
        text.contains("`k * nu_surge` is in [kg m^2 s^-3], expected [N]"),
        "{text}"
    );
    let text = surge("k * (depth + nu_surge) / depth");
    assert!(
        text.contains("`nu_surge` is in [m/s], expected [m]"),
        "{text}"
    );
    assert!(surge("k * exp(t)").contains("`t` is in [s], expected [1]"));
    assert!(surge("k * nu_surge^0.5").contains("`nu_surge` is in [m/s], expected [1]"));
    // Zero is zero in every unit.
    assert!(
        register_toml(
            "zero",
            &small("[wrench]\nsurge = \"k * step(max(nu_surge, 0))\"\n")
        )
        .is_ok()
    );
    let text = fault(&small(
        "[parameters.frequency]\nunit = \"m\"\nlower = 1\nupper = 2\nnull = 1\nprior_sd = 1\n",
    ));
    assert!(text.contains("nothing acts"), "{text}");
    let text = fault(&small(
        "[wrench]\nsurge = \"k\"\n[parameters.frequency]\nunit = \"m\"\nlower = 1\nupper = 2\nnull = 1\nprior_sd = 1\n",
    ));
    assert!(
        text.contains("`frequency` is in [m], expected [1/s]"),
        "{text}"
    );
}

#[test]
fn an_unbounded_parameter_is_refused() {
    let with = |from: &str, to: &str| fault(&small("[wrench]\nsurge = \"k\"\n").replace(from, to));
    assert!(
        with("upper = 2\n", "").contains("[parameters.k]: needs `lower` and `upper`, both finite")
    );
    assert!(
        with("upper = 2", "upper = inf").contains("[parameters.k] upper: inf, expected a number")
    );
    assert!(with("lower = -1", "lower = nan").contains("NaN, expected a number"));
    assert!(with("lower = -1", "lower = 3").contains("lower 3 is not below upper 2"));
    assert!(
        with("lower = -1", "lower = 1")
            .contains("null 0, the value without effect, is not between 1 and 2")
    );
    assert!(
        with("prior_sd = 1", "prior_sd = 0").contains("prior_sd 0, expected a number above zero")
    );
    assert!(with("prior_sd = 1", "prior_sd = nan").contains("NaN"));
}

#[test]
fn an_unbounded_expression_is_refused() {
    let text = surge("k * exp(depth / 1e-3)");
    assert!(text.contains("`depth / 1e-3` is in [m]"), "{text}");
    let text = surge("k * exp(1e4 * up_x)");
    assert!(
        text.contains("`exp(1e4 * up_x)` may be infinite within the bounds"),
        "{text}"
    );
    assert!(surge("k * (up_x * 1e200)^3").contains("may be infinite"));
    assert!(
        surge("k * ln(up_x)")
            .contains("ln of `up_x`, which lies between -1 and 1; ln needs a number above zero")
    );
    assert!(surge("k * sqrt(up_x)").contains("sqrt needs a number that is never negative"));
    assert!(surge("k * up_x^0.5").contains("a broken power needs"));
}

#[test]
fn division_by_zero_is_refused() {
    let text = surge("k / norm(up_x, up_y)");
    assert!(
        text.contains("`norm(up_x, up_y)` may be zero (it lies between 0 and 1.414"),
        "{text}"
    );
    assert!(surge("k * up_x^-1").contains("`up_x` may be zero"));
    assert!(surge("k * abs(up_x)^(-0.5)").contains("`abs(up_x)` may be zero"));
    assert!(surge("k / 0").contains("`0` may be zero"));
    assert!(
        register_toml(
            "safe",
            &small("[wrench]\nsurge = \"k / max(norm(up_x, up_y), 0.1)\"\n")
        )
        .is_ok()
    );
}

#[test]
fn what_is_too_long_or_too_deep_is_refused() {
    assert!(
        surge(&format!("k * {}1", "1 * ".repeat(300)))
            .contains("letters of an expression: 1205, at most 1000")
    );
    assert!(
        surge(&format!("{}k{}", "(".repeat(33), ")".repeat(33)))
            .contains("parentheses within each other: 33, at most 32")
    );
    assert!(
        surge(&format!("k{}", " + k".repeat(60)))
            .contains("depth of the expression: 49, at most 48")
    );
    assert!(surge(&format!("{}k", "-".repeat(900))).contains("at most 32"));
    let lets: String = (0..17).map(|at| format!("a{at} = \"1\"\n")).collect();
    let text = fault(&small(&format!("[wrench]\nsurge = \"k\"\n[let]\n{lets}")));
    assert!(text.contains("[let]: 17, at most 16"), "{text}");
    let many: String = (0..13)
        .map(|at| format!("[parameters.p{at}]\nunit = \"1\"\nlower = 0\nupper = 1\nprior_sd = 1\n"))
        .collect();
    assert!(
        fault(&small(&format!("[wrench]\nsurge = \"k\"\n{many}")))
            .contains("parameters: 14, at most 12")
    );
    let long = format!("{}\n#{}", small(""), "x".repeat(70_000));
    assert!(fault(&long).contains("bytes of the file: 70"));
    let mut value = serde_json::json!({"summary": "s", "target": "body"});
    value["summary"] = "x".repeat(70_000).into();
    let found = register_json("user.long", &value).expect_err("it is long");
    assert!(
        found.to_string().contains("bytes of the definition: 700"),
        "{found}"
    );
    // As many instructions as that many expressions of this length may have.
    let sum = vec!["k"; 40].join("+");
    let wide = format!("{sum}+({sum})+({sum})");
    let axes = ["surge", "sway", "heave"]
        .map(|axis| format!("{axis} = \"{wide}\"\n"))
        .concat();
    let lets: String = (0..9).map(|at| format!("a{at} = \"{wide}\"\n")).collect();
    let used = (0..9)
        .map(|at| format!("a{at}"))
        .collect::<Vec<_>>()
        .join("+");
    let text = fault(&small(&format!(
        "[world_force]\nx = \"{used}\"\n[wrench]\n{axes}[let]\n{lets}"
    )));
    assert!(
        text.contains("instructions so far") && text.contains("at most 2000"),
        "{text}"
    );
}

#[test]
fn names_are_checked() {
    let text = small("[wrench]\nsurge = \"k\"\n");
    for name in ["linear_drag", "payload"] {
        let found = register_toml(name, &text)
            .expect_err("it is built in")
            .to_string();
        assert!(
            found.contains(&format!("`{name}` is the name of a built-in effect")),
            "{found}"
        );
    }
    for name in ["", "2fast", "a b", "a-b", "ä", &"x".repeat(41)] {
        let found = register_toml(name, &text).expect_err(name).to_string();
        assert!(found.contains("is no name"), "{found}");
    }
    let taken = |more: &str| fault(&format!("{text}{more}"));
    let constant = |name: &str| taken(&format!("[constants.{name}]\nvalue = 1\nunit = \"1\"\n"));
    assert!(constant("depth").contains("`depth` stands for a quantity of the simulation already"));
    assert!(constant("sqrt").contains("`sqrt` stands for a function already"));
    assert!(constant("k").contains("`k` stands for a parameter already"));
    assert!(taken("[let]\nmemory = \"1\"\n").contains("`memory` stands for the memory already"));
}

#[test]
fn the_parts_are_those_of_the_target() {
    let text = small("[wrench]\nsurge = \"k\"\n");
    assert!(
        fault(&text.replace("\"body\"", "\"bdy\""))
            .contains("target `bdy`; expected `body`, `hinge` or `slide`; did you mean `body`?")
    );
    assert!(
        fault(&text.replace("\"body\"", "\"slide\"")).contains("a hinge or slide takes `force`")
    );
    assert!(
        fault(&text.replace("summary", "force = \"k\"\nsummary"))
            .contains("`force` is of a hinge or slide")
    );
    assert!(
        fault(&text.replace("surge =", "sruge ="))
            .contains("[wrench] has no `sruge`; did you mean `surge`?")
    );
    assert!(fault(&text.replace("[wrench]", "[wrnech]")).contains("unknown field `wrnech`"));
    assert!(fault("target = 3").contains("line 1"));
    assert!(
        fault(&small("[wrench]\nsurge = \"1 + \"\n"))
            .contains("column 5: something is missing at the end")
    );
    assert!(surge("k $ 2").contains("column 3: `$` is not expected here"));
    assert!(surge("k * (1").contains("a `)` is missing"));
    assert!(surge("min(k)").contains("min takes two numbers, not 1"));
    assert!(surge("sin(up_x, 2)").contains("sin takes one number, not 2"));
    assert!(surge("k * 1e999").contains("is no finite number"));
    assert!(surge("k * 1..2").contains("is no finite number"));
    let joint = "summary = \"s\"\ntarget = \"hinge\"\n";
    assert!(fault(joint).contains("needs `force`"));
    assert!(fault(&small("[inertia]\nsurge = \"k / 9.81 * 1\"\n")).contains("expected [kg]"));
    let negative = small(
        "[inertia]\nsurge = \"m\"\n[parameters.m]\nunit = \"kg\"\nlower = -1\nupper = 1\nprior_sd = 1\n",
    );
    assert!(fault(&negative).contains("inertia is never negative"));
    assert!(fault(&text.replace("summary", "point = [0, 0, inf]\nsummary")).contains("point: inf"));
}

#[test]
fn what_depends_on_itself_is_refused() {
    let text = fault(&small(
        "[wrench]\nsurge = \"k * a\"\n[let]\na = \"b\"\nb = \"a + 1\"\n",
    ));
    assert!(text.contains("depends on itself"), "{text}");
    let text = fault(&LAGGING.replace("\"qdot\"", "\"qdot - memory\""));
    assert!(text.contains("`memory` depends on itself"), "{text}");
    let text = fault(&LAGGING.replace("time_constant = \"tau\"", "time_constant = \"tau * q\""));
    assert!(
        text.contains("[memory] time_constant: there is no `q`"),
        "{text}"
    );
    let text = fault(&LAGGING.replace("lower = 0.1", "lower = -0.1"));
    assert!(
        text.contains("[memory] time_constant: it lies between -0.1 and 5 s; expected above zero"),
        "{text}"
    );
}

#[test]
fn without_its_parameters_an_effect_does_nothing() {
    assert!(surge("k + 0.1 * k / k").contains("may be zero"));
    let text = fault(&small(
        "[wrench]\nsurge = \"k + w\"\n[constants.w]\nvalue = 2\nunit = \"N\"\n",
    ));
    assert!(
        text.contains("[wrench] surge: with every parameter at its null the effect must be zero"),
        "{text}"
    );
    let two = small(
        "[wrench]\nsurge = \"k * a\"\n[parameters.a]\nunit = \"1\"\nlower = 0\nupper = 1\nprior_sd = 1\n",
    );
    assert!(fault(&two).contains("no parameter moves the effect away from zero by itself"));
    let shapes = |text: &str, name: &str| -> Vec<bool> {
        let target = crate::tests::fixture::target(own(name, text).card().target);
        let parameters = own(name, text).parameters(&target);
        parameters.iter().map(|of| of.shapes).collect()
    };
    // drag, length, stiffness; amount, offset, tau.
    assert_eq!(shapes(TETHER, "tether"), [false, true, false]);
    assert_eq!(shapes(LAGGING, "lagging"), [false, false, true]);
}

#[test]
fn a_tether_pulls_along_the_line_and_drags() {
    let tether = own("tether", TETHER);
    assert_eq!(tether.card().id.as_str(), "user.tether");
    assert_eq!(tether.card().phrase, "a tether");
    let part = body(tether);
    let (drag, length, stiffness) = (4.0, 2.0, 30.0);
    let mut motion = still();
    motion.position = [1.0, 2.0, -1.0];
    motion.world_from_base = UnitQuaternion::from_euler_angles(0.3, -0.7, 2.0);
    (motion.linear, motion.angular) = ([0.4, -0.2, 0.1], [0.3, 0.5, -0.7]);
    let wrench = part.wrench(&[drag, length, stiffness], &motion, &[]);
    let point = Vector3::new(-0.4, 0.0, 0.1);
    let rotation = motion.world_from_base;
    let away = Vector3::from(motion.position) + rotation * point - Vector3::new(0.0, 0.0, -3.0);
    let velocity =
        rotation * (Vector3::from(motion.linear) + Vector3::from(motion.angular).cross(&point));
    let force =
        -stiffness * (away.norm() - length) * away.normalize() - drag * velocity.norm() * velocity;
    let force = rotation.inverse() * force;
    let torque = point.cross(&force);
    for axis in 0..3 {
        assert!((wrench[axis] - force[axis]).abs() < 1e-12);
        assert!((wrench[axis + 3] - torque[axis]).abs() < 1e-12);
    }
    // Slack, and in the anchor itself.
    assert_eq!(part.wrench(&[0.0, 10.0, stiffness], &motion, &[]), [0.0; 6]);
    motion.position = (Vector3::new(0.0, 0.0, -3.0) - rotation * point).into();
    assert!(
        part.wrench(&[0.0, length, stiffness], &motion, &[])
            .iter()
            .all(|f| f.abs() < 1e-9)
    );
}

#[test]
fn a_memory_is_exact_for_a_constant_input() {
    let lagging = joint(own("lagging", LAGGING));
    assert_eq!(lagging.memory_len(), 1);
    assert_eq!(own("lagging", LAGGING).commands(), ["thruster_1"]);
    let p = [2.0, 0.5, 0.7];
    let mut motion = JointMotion::new(0.1, 1.5);
    motion.commands = vec![0.4];
    let mut memory = [0.0];
    for _ in 0..50 {
        lagging.advance(&p, &motion, 0.02, &mut memory);
    }
    let expected = 1.5 * (1.0 - (-1.0_f64 / 0.7).exp());
    assert!((memory[0] - expected).abs() < 1e-12, "{}", memory[0]);
    // One step as long as the fifty.
    let mut once = [0.0];
    lagging.advance(&p, &motion, 1.0, &mut once);
    assert!((once[0] - expected).abs() < 1e-12);
    let force = lagging.force(&p, &motion, &memory);
    assert!((force - (-2.0 * expected * expected - 0.5 * 0.4)).abs() < 1e-12);
    assert_eq!(lagging.damping(&p, &motion, &memory), 0.0);
}

#[test]
fn what_is_not_a_number_stays_so_and_absurd_motion_is_held() {
    let part = body(own("tether", TETHER));
    for speed in [0.0, 1e300, f64::MAX, f64::INFINITY, f64::NEG_INFINITY] {
        let mut motion = still();
        (motion.linear, motion.angular, motion.position) = ([speed; 3], [-speed; 3], [speed; 3]);
        for value in [0.0, 1e300, -1e300, f64::INFINITY] {
            let wrench = part.wrench(&[value; 3], &motion, &[]);
            assert!(
                wrench.iter().all(|f| f.is_finite()),
                "{speed} {value} {wrench:?}"
            );
        }
    }
    let lagging = joint(own("lagging", LAGGING));
    let motion = JointMotion::new(0.0, 1.0);
    let mut memory = [f64::NAN];
    assert!(lagging.force(&[1.0, 0.0, 0.5], &motion, &memory).is_nan());
    lagging.advance(&[1.0, 0.0, 0.5], &motion, 0.1, &mut memory);
    assert!(memory[0].is_nan());
    let mut memory = [0.25];
    let none = JointMotion::new(0.0, f64::NAN);
    lagging.advance(&[1.0, 0.0, 0.5], &none, 0.1, &mut memory);
    assert_eq!(memory[0], 0.25);
}

#[test]
fn inertia_is_that_of_its_coefficients() {
    let text = r#"
        summary = "water in a tank, half of it below a metre of depth"
        target = "body"
        [parameters.mass]
        unit = "kg"
        lower = 0
        upper = 50
        prior_sd = 5
        [inertia]
        surge = "mass"
        heave = "mass * (1 + step(depth - metre)) / 2"
        [constants.metre]
        value = 1
        unit = "m"
    "#;
    let part = body(own("sloshing", text));
    assert!(part.has_inertia());
    let mut motion = still();
    motion.depth = Some(0.5);
    let inertia = part.inertia(&[4.0], &motion).expect("inertia");
    assert_eq!(
        (inertia[(0, 0)], inertia[(1, 1)], inertia[(2, 2)]),
        (4.0, 0.0, 2.0)
    );
    motion.depth = None;
    assert_eq!(part.inertia(&[4.0], &motion).expect("inertia")[(2, 2)], 4.0);
    assert_eq!(part.wrench(&[4.0], &motion, &[]), [0.0; 6]);
}

#[test]
fn the_same_definition_is_one_effect_and_another_is_not() {
    let first = register_toml("twin", TETHER).expect("a definition");
    let spaced = TETHER.replace("[let]", "\n\n[let]");
    assert_eq!(register_toml("twin", &spaced), Ok(first));
    let other = TETHER.replace("upper = 500.0", "upper = 600.0");
    let second = register_toml("twin", &other).expect("a definition");
    assert_ne!(first, second);
    assert_eq!(Id::from_name("user.twin"), Some(second));
    // The name means what was told last.
    assert_eq!(register_toml("twin", TETHER), Ok(first));
    assert_eq!(Id::from_name("user.twin"), Some(first));
    let text = serde_json::to_string(&first).expect("JSON");
    assert_eq!(text, "\"user.twin\"");
    assert_eq!(serde_json::from_str::<Id>(&text).expect("an id"), first);
    assert!(serde_json::from_str::<Id>("\"user.nobody\"").is_err());
    let definition = effect(first).definition().expect("a definition");
    let value = serde_json::from_str(definition).expect("JSON");
    assert_eq!(register_json("user.twin", &value), Ok(first));
    assert!(
        register_json("twin", &value)
            .expect_err("no prefix")
            .to_string()
            .contains("user.NAME")
    );
}

#[test]
fn effects_json_carries_the_definition() {
    let id = register_toml("tether", TETHER).expect("a definition");
    let set = EffectSet {
        entries: vec![Entry {
            effect: id,
            target: "hull".to_owned(),
            parameters: vec![4.0, 2.5, 30.0],
        }],
    };
    let text = set.to_json(&Model).expect("text");
    let back = EffectSet::parse(&text, &Model).expect("the same");
    assert_eq!(back.entries[0].effect.as_str(), "user.tether");
    assert_eq!(back.entries[0].parameters, set.entries[0].parameters);
    let parse = |text: &str| match EffectSet::parse(text, &Model) {
        Ok(_) => panic!("it should be refused"),
        Err(error) => error.to_string(),
    };
    let mut value: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let definition = value["effects"][0]["definition"].take();
    assert!(parse(&value.to_string()).contains("effects[0], user.tether:"));
    let bare = value["effects"][0].as_object_mut().expect("an object");
    bare.remove("definition");
    let text = value.to_string();
    assert!(
        parse(&text).contains(
            "effects[0], user.tether: an effect of the user's own needs its `definition`"
        ),
        "{}",
        parse(&text)
    );
    value["effects"][0]["definition"] = definition.clone();
    value["effects"][0]["definition"]["world_force"]["x"] = "-pul * x".into();
    assert!(parse(&value.to_string()).contains("did you mean `pull`?"));
    value["effects"][0]["definition"] = definition.clone();
    value["effects"][0]["effect"] = "linear_drag".into();
    assert!(parse(&value.to_string()).contains("only an effect `user.NAME` has a definition"));
    value["effects"][0]["effect"] = "user.tether".into();
    value["effects"][0]["parameters"]["stiffness"] = 501.0.into();
    assert!(parse(&value.to_string()).contains("stiffness is 501 [N/m], expected 0 to 500"));
    // A second definition of the name.
    value["effects"][0]["parameters"]["stiffness"] = 30.0.into();
    let mut second = value["effects"][0].clone();
    second["definition"]["summary"] = "another".into();
    let list = value["effects"].as_array_mut().expect("a list");
    list.push(second);
    assert!(parse(&value.to_string()).contains("user.tether is defined twice, and not alike"));
}

#[test]
fn a_hinge_is_no_slide() {
    let text = LAGGING
        .replace("\"hinge\"", "\"slide\"")
        .replace("N m s^2/rad^2", "N s^2/m^2");
    let id = register_toml("sliding", &text.replace("\"N m\"", "\"N\"")).expect("a definition");
    let set = EffectSet {
        entries: vec![Entry {
            effect: id,
            target: "knee".to_owned(),
            parameters: vec![1.0, 0.0, 0.5],
        }],
    };
    let text = set.to_json(&Model).expect_err("a hinge").to_string();
    assert!(
        text.contains("user.sliding cannot act on knee: it acts on a slide, and this is a hinge"),
        "{text}"
    );
}

/// Motion as an expression sees it: any.
struct Anything;

impl Known for Anything {
    fn input(&mut self, _: usize) -> Result<Facts, OwnError> {
        Ok(Facts {
            dimension: Some(Dimension::NUMBER),
            range: Range::new(-3.0, 3.0),
        })
    }

    fn local(&mut self, _: usize) -> Result<Facts, OwnError> {
        self.input(0)
    }
}

/// A tree's value by plain recursion.
fn plain(node: &Node, inputs: &[f64]) -> f64 {
    match &node.kind {
        Kind::Number(value) => *value,
        Kind::Input(at) | Kind::Local(at) => inputs[*at],
        Kind::Whole(a, power) => plain(a, inputs).powi(*power),
        Kind::Unary(of, a) => {
            let a = plain(a, inputs);
            match of {
                Unary::Minus => -a,
                Unary::Abs => a.abs(),
                Unary::Sign => {
                    if a == 0.0 {
                        0.0
                    } else {
                        a.signum()
                    }
                }
                Unary::Step => {
                    if a.is_nan() {
                        a
                    } else {
                        f64::from(u8::from(a > 0.0))
                    }
                }
                Unary::Sqrt => a.sqrt(),
                Unary::Exp => a.exp(),
                Unary::Ln => a.ln(),
                Unary::Sin => a.sin(),
                Unary::Cos => a.cos(),
                Unary::Tanh => a.tanh(),
                Unary::Atan => a.atan(),
            }
        }
        Kind::Binary(of, a, b) => {
            let (a, b) = (plain(a, inputs), plain(b, inputs));
            match of {
                Binary::Add => a + b,
                Binary::Subtract => a - b,
                Binary::Multiply => a * b,
                Binary::Divide => a / b,
                Binary::Power => a.powf(b),
                _ if a.is_nan() || b.is_nan() => f64::NAN,
                Binary::Min => a.min(b),
                Binary::Max => a.max(b),
            }
        }
    }
}

/// The text of any expression over a, b and c.
fn any_text() -> impl Strategy<Value = String> {
    let leaf = prop_oneof![
        (0..4_u8).prop_map(|at| ["a", "b", "c", "0"][at as usize].to_owned()),
        (-5.0..5.0_f64).prop_map(|value| format!("({value:.3})")),
    ];
    leaf.prop_recursive(5, 40, 3, |inner| {
        let functions = [
            "abs", "sign", "step", "sqrt", "exp", "ln", "sin", "cos", "tanh", "atan", "-",
        ];
        prop_oneof![
            (0..functions.len(), inner.clone())
                .prop_map(move |(at, a)| format!("{}({a})", functions[at])),
            (0..5_usize, inner.clone(), inner.clone())
                .prop_map(|(at, a, b)| format!("({a} {} {b})", ["+", "-", "*", "/", "^"][at])),
            (0..3_usize, inner.clone(), inner.clone())
                .prop_map(|(at, a, b)| format!("{}({a}, {b})", ["min", "max", "norm"][at])),
            (inner.clone(), inner.clone(), inner.clone())
                .prop_map(|(a, b, c)| format!("clamp({a}, {b}, {c})")),
            (inner, -3..4_i32).prop_map(|(a, power)| format!("({a})^{power}")),
        ]
    })
}

fn names() -> Vec<(String, Meaning)> {
    let names = ["a", "b", "c"].iter().enumerate();
    names
        .map(|(at, name)| ((*name).to_owned(), Meaning::Input(at)))
        .collect()
}

fn same(a: f64, b: f64) -> bool {
    (a.is_nan() && b.is_nan()) || a == b || (a - b).abs() <= 1e-9 * a.abs().max(b.abs())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    #[test]
    fn the_parser_never_panics(text in "\\PC{0,60}") {
        let _ = Expression::parse("f", &text, &names());
    }

    #[test]
    fn the_parser_never_panics_on_its_own_signs(text in "[abc0-9.e+*/^(), -]{0,80}|(abs|min|norm|clamp|[a-c(),^-]){0,60}") {
        if let Ok(of) = Expression::parse("f", &text, &names()) {
            let _ = facts(&of, &mut Anything);
            if let Ok(program) = Program::compile([(0, &of)], &[]) {
                program.run(&[1.0, -2.0, 0.5], &mut [0.0]);
            }
        }
    }

    #[test]
    fn files_never_panic(lines in prop::collection::vec(
        "(summary|target|\\[let\\]|\\[wrench\\]|\\[parameters.k\\]|surge|force|unit|lower|upper|prior_sd|a)( = (\"(body|hinge|k|a|N|1|k \\* a)\"|-?[0-9]|inf|\\[1, 2, 3\\]))?", 0..16,
    )) {
        let _ = register_toml("random", &lines.join("\n"));
    }

    #[test]
    fn a_program_is_a_plain_evaluation_of_the_tree(
        text in any_text(), inputs in prop::array::uniform3(-3.0..3.0),
    ) {
        let Ok(of) = Expression::parse("f", &text, &names()) else { return Ok(()) };
        let Ok(program) = Program::compile([(0, &of)], &[]) else { return Ok(()) };
        let mut out = [0.0];
        program.run(&inputs, &mut out);
        let expected = plain(&of.root, &inputs);
        prop_assert!(same(out[0], expected), "{text}: {} {expected}", out[0]);
    }

    /// What passes the check is finite, and within the interval that it gave.
    #[test]
    fn what_passes_is_finite(text in any_text(), inputs in prop::array::uniform3(-3.0..3.0)) {
        let Ok(of) = Expression::parse("f", &text, &names()) else { return Ok(()) };
        let Ok(Facts { range, .. }) = facts(&of, &mut Anything) else { return Ok(()) };
        let value = plain(&of.root, &inputs);
        let slack = 1e-9 * (1.0 + range.lower.abs().max(range.upper.abs()));
        prop_assert!(value.is_finite(), "{text} at {inputs:?}");
        prop_assert!(range.lower - slack <= value && value <= range.upper + slack, "{text}: {value} {range:?}");
    }

    #[test]
    fn slopes_of_an_own_effect_are_its_slopes(motion in any_motion(), draws in prop::array::uniform3(0.1..1.0)) {
        let part = body(own("tether", TETHER));
        let p = [20.0 * draws[0], 0.5 + 0.2 * draws[1], 100.0 * draws[2]];
        let wrench = |motion: &Motion, p: &[f64]| part.wrench(p, motion, &[]);
        let scale = 1.0 + wrench(&motion, &p).iter().fold(0.0_f64, |size, f| size.max(f.abs()));
        let damping = part.damping(&p, &motion, &[]).expect("damping");
        let step = 1e-6;
        for axis in 0..6 {
            let moved = |by: f64| {
                let mut motion = motion.clone();
                if axis < 3 { motion.linear[axis] += by } else { motion.angular[axis - 3] += by }
                wrench(&motion, &p)
            };
            let (before, after) = (moved(-step), moved(step));
            for row in 0..6 {
                let slope = (after[row] - before[row]) / (2.0 * step);
                prop_assert!((slope + damping[(row, axis)]).abs() < 1e-5 * scale, "{row} {axis}");
            }
        }
        let columns = part.by_parameters(&p, &motion, &[]);
        for at in 0..3 {
            let moved = |by: f64| { let mut p = p; p[at] += by; wrench(&motion, &p) };
            let (before, after) = (moved(-step), moved(step));
            for row in 0..6 {
                let slope = (after[row] - before[row]) / (2.0 * step);
                prop_assert!((slope - columns[at][row]).abs() < 1e-5 * scale, "{row} {at}");
            }
        }
    }
}
