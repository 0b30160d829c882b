//! Checks of the units and frames that a checkpoint or a data set declares.

use std::collections::BTreeMap;

/// The fault in `output_units` of these force components, if there is one: a `force.*` is in N, a `torque.*` in N m.
pub fn output_units_fault(outputs: &[String], units: &[String]) -> Option<String> {
    if units.len() != outputs.len() {
        let (found, expected) = (units.len(), outputs.len());
        return Some(format!(
            "output_units has {found} entries, expected {expected}"
        ));
    }
    outputs.iter().zip(units).find_map(|(output, found)| {
        let expected = match output.split_once('.')?.0 {
            "force" => "N",
            "torque" => "N m",
            // Of a slide.
            "joint_torque" if found == "N" => "N",
            "joint_torque" => "N m",
            _ => return None,
        };
        (found != expected)
            .then(|| format!("output_units gives `{output}` in [{found}], expected [{expected}]"))
    })
}

/// The fault in a `frames` map, if there is one: its vectors are expressed in the base frame, written `base`, with or
/// without further words.
pub fn frames_fault(frames: &BTreeMap<String, String>) -> Option<String> {
    ["wrench", "angular_velocity", "linear_velocity"]
        .into_iter()
        .find_map(|vector| {
            let found = frames.get(vector)?;
            let first = found.split([',', ' ']).next();
            (first != Some("base")).then(|| {
                format!("frames gives `{vector}` in \"{found}\", expected the frame \"base\"")
            })
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vectors_are_in_the_base_frame_or_not_named() {
        let fault = |vector: &str, frame: &str| {
            frames_fault(&BTreeMap::from([(vector.to_owned(), frame.to_owned())]))
        };
        assert_eq!(frames_fault(&BTreeMap::new()), None);
        assert_eq!(fault("wrench", "base"), None);
        assert_eq!(
            fault("linear_velocity", "base, relative to the water"),
            None
        );
        assert_eq!(fault("quaternion", "world_from_base, w x y z"), None);
        for frame in ["world", "basement", ""] {
            let message = fault("angular_velocity", frame).expect("a fault");
            assert!(
                message.contains("`angular_velocity`") && message.contains(frame),
                "{message}"
            );
        }
    }
}
