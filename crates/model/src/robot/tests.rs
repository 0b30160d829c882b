//! Reading a URDF: what is fused, what is kept, every refusal.
#![allow(clippy::unwrap_used)]

mod odd;

use super::*;

const ARM: &str = r#"<robot name="arm">
  <link name="root"/>
  <link name="base"><inertial><origin xyz="0 0 1"/><mass value="2"/>
    <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
    <collision><geometry><box size="1 2 3"/></geometry></collision></link>
  <link name="tip"><inertial><mass value="2"/>
    <inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/></inertial>
    <collision><geometry><sphere radius="0.5"/></geometry></collision></link>
  <link name="rod"><inertial><mass value="1"/>
    <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.2" iyz="0" izz="0.3"/></inertial></link>
  <joint name="ground" type="fixed"><parent link="root"/><child link="base"/></joint>
  <joint name="weld" type="fixed"><origin xyz="0 0 -1"/><parent link="base"/><child link="tip"/></joint>
  <joint name="swing" type="revolute"><origin xyz="1 0 0" rpy="0 0 1.5707963267948966"/><axis xyz="0 2 0"/>
    <parent link="base"/><child link="rod"/><limit lower="-1" upper="2" effort="3" velocity="4"/></joint>
</robot>"#;

fn read(text: &str) -> Result<Robot, RobotError> {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), text).unwrap();
    Robot::from_urdf(file.path())
}

#[test]
fn fixed_links_are_fused_by_the_parallel_axis_theorem() {
    let robot = read(ARM).unwrap();
    let names: Vec<&str> = robot.bodies.iter().map(|body| body.name.as_str()).collect();
    assert_eq!(names, ["root", "rod"]);
    let base = robot.bodies[0].inertia;
    // Two masses of 2 kg at z = +1 and z = -1: centre at 0, ixx = 1 + 2 * 2 * 1^2.
    assert_eq!(base.mass, 4.0);
    assert!(base.centre.norm() < 1e-12);
    assert!((base.tensor[(0, 0)] - 5.0).abs() < 1e-12);
    assert!((base.tensor[(2, 2)] - 1.0).abs() < 1e-12);
    assert!((robot.displaced_volume() - (6.0 + PI / 6.0)).abs() < 1e-12);
    assert_eq!(robot.mass(), 5.0);
}

#[test]
fn a_joint_keeps_its_axis_limits_and_pose() {
    let robot = read(ARM).unwrap();
    let joint = &robot.joints[0];
    assert_eq!(robot.joint_names(), ["swing"]);
    assert_eq!(joint.axis, Vector3::new(0.0, 1.0, 0.0));
    assert_eq!(
        (joint.range, joint.effort, joint.velocity),
        ([-1.0, 2.0], 3.0, 4.0)
    );
    let x_of_child = joint.parent_from_child * Vector3::x();
    assert!((x_of_child - Vector3::y()).norm() < 1e-12);
}

#[test]
fn what_is_no_tree_of_finite_numbers_is_refused() {
    let message = |text: &str| read(text).unwrap_err().to_string();
    let ring = ARM.replace(
        "</robot>",
        "<joint name=\"back\" type=\"fixed\"><parent link=\"tip\"/><child link=\"root\"/></joint></robot>",
    );
    let text = message(&ring);
    assert!(text.contains("stands above itself by joint"), "{text}");
    let twice = message(&ARM.replace("name=\"tip\"", "name=\"base\""));
    assert!(twice.contains("two links are called `base`"), "{twice}");
    let two = ARM.replace(
        "</robot>",
        "<joint name=\"more\" type=\"fixed\"><parent link=\"base\"/><child link=\"tip\"/></joint></robot>",
    );
    assert!(message(&two).contains("`tip` is the child of two joints"));
    for (sound, odd, expected) in [
        (
            "radius=\"0.5\"",
            "radius=\"nan\"",
            "a collision shape with a size of NaN m",
        ),
        ("radius=\"0.5\"", "radius=\"-1\"", "a size of -1 m"),
        ("size=\"1 2 3\"", "size=\"-1 -2 3\"", "a size of -1 m"),
        ("size=\"1 2 3\"", "size=\"1e200 1e200 3\"", "inf m^3"),
        ("xyz=\"0 2 0\"", "xyz=\"1e200 0 0\"", "expected a direction"),
        (
            "xyz=\"0 0 -1\"",
            "xyz=\"0 0 1e200\"",
            "`root`: with what is fixed to it",
        ),
        (
            "mass value=\"2\"",
            "mass value=\"1e308\"",
            "beyond all numbers",
        ),
        ("xyz=\"0 0 1\"", "xyz=\"0 0 inf\"", "inf in its inertial"),
        ("xyz=\"1 0 0\"", "xyz=\"nan 0 0\"", "joint `swing`: NaN"),
        (
            "<axis xyz=\"0 2 0\"/>",
            "<axis xyz=\"0 0 0\"/>",
            "expected a direction",
        ),
    ] {
        let text = message(&ARM.replace(sound, odd));
        assert!(text.contains(expected), "{text}");
    }
}

#[test]
fn a_deep_file_does_not_reach_the_reader_that_recurses() {
    let deep = |inside: &str| {
        let (open, close) = (inside.repeat(100_000), "</link>".repeat(100_000));
        let text = format!("<robot name=\"r\">\n{open}{close}</robot>");
        read(&text).unwrap_err().to_string()
    };
    for open in [
        "<link>",
        "<link x=\"/>\">",
        "<link><?p ></x>?>",
        "<link><!-- </x> -->",
        "<link><![CDATA[</x>]]>",
    ] {
        let text = deep(open);
        assert!(text.contains("line 2: more than 64 elements"), "{text}");
    }
    // What is no XML, and instructions that the reader ends at the first `>`.
    for open in [
        "<link\">",
        "<!--><link>-->",
        "<!DOCTYPE [ <y> </x> ]><link>",
    ] {
        assert!(deep(open).contains("cannot read this as a URDF"));
    }
    let hidden = "<?p ? ><link>?>".repeat(100_000);
    read(&format!("<robot name=\"r\">{hidden}</robot>")).unwrap();
    let text = read("<!DOCTYPE robot [<!ELEMENT robot ANY>]>\n<robot name=\"r\"/>");
    assert!(text.unwrap_err().to_string().contains("DTD"));
    let chain: String = (0..3000)
        .map(|i| {
            format!(
                "<link name=\"l{i}\"/><joint name=\"j{i}\" type=\"fixed\"><parent link=\"l{i}\"/><child link=\"l{}\"/></joint>",
                i + 1
            )
        })
        .collect();
    read(&format!(
        "<robot name=\"r\"><!-- {} -->{chain}<link name=\"l3000\"/></robot>",
        "<a>".repeat(100)
    ))
    .unwrap();
}

#[test]
fn refusals_say_what_was_found() {
    let heavy = read(&ARM.replace(r#"<mass value="1"/>"#, r#"<mass value="-1"/>"#));
    assert!(
        heavy
            .unwrap_err()
            .to_string()
            .contains("link `rod`: mass -1 kg")
    );
    let adrift = read(&ARM.replace(r#"<child link="rod"/>"#, r#"<child link="rot"/>"#));
    let message = adrift.unwrap_err().to_string();
    assert!(
        message.contains("joint `swing`") && message.contains("links: root, base"),
        "{message}"
    );
    let missing = Robot::from_urdf(Path::new("no/such.urdf")).unwrap_err();
    assert!(missing.to_string().starts_with("no/such.urdf"));
}
