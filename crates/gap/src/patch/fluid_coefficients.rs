//! Coefficients of MuJoCo's own fluid in plain MJCF.

use roxmltree::Node;

use super::{
    mjcf::{Mjcf, parse_numbers},
    xml_edit::{Edits, number, numbers},
};

/// Numbers of `fluidcoef`.
pub(super) const COEFFICIENTS: usize = 5;

/// MuJoCo's defaults: blunt drag, slender drag, angular drag, Kutta lift, Magnus lift.
const DEFAULT: [f64; COEFFICIENTS] = [0.5, 0.25, 1.5, 1.0, 1.0];

/// Scales the coefficients of every geom: wherever `fluidcoef` is given, in geoms and in classes, and where the ellipsoid
/// fluid is switched on with MuJoCo's default coefficients.
pub(super) fn scale(model: &Mjcf<'_>, factors: [f64; COEFFICIENTS]) -> Result<String, String> {
    let elsewhere = |node: Node<'_, '_>| ["attach", "model"].contains(&node.tag_name().name());
    if model.root().descendants().any(elsewhere) {
        return Err("geoms of an attached model are not in the text".to_owned());
    }
    let mut edits = Edits::new(model.text);
    for geom in model.elements("geom") {
        let (above, given) = inherited(model, geom);
        let switched_on = geom.attribute("fluidshape") == Some("ellipsoid");
        if geom.has_attribute("fluidcoef") || (switched_on && !given) {
            set_scaled(&mut edits, geom, above, factors);
        }
    }
    Ok(edits.apply())
}

/// Scales the coefficients of one geom of a body, by its name.
pub(super) fn scale_one(
    model: &Mjcf<'_>,
    name: &str,
    factors: [f64; COEFFICIENTS],
) -> Result<String, String> {
    let geoms = model.bodies().flat_map(|body| body.children());
    let mut named =
        geoms.filter(|node| node.has_tag_name("geom") && node.attribute("name") == Some(name));
    let (Some(geom), None) = (named.next(), named.next()) else {
        return Err(format!("no body has a single geom `{name}` in the text"));
    };
    let (above, _) = inherited(model, geom);
    let mut edits = Edits::new(model.text);
    set_scaled(&mut edits, geom, above, factors);
    Ok(edits.apply())
}

/// Writes the scaled coefficients of a geom, whose classes give `above`; nothing where none changes.
fn set_scaled(
    edits: &mut Edits<'_>,
    geom: Node<'_, '_>,
    above: [f64; COEFFICIENTS],
    factors: [f64; COEFFICIENTS],
) {
    let own = geom.attribute("fluidcoef").map(parse_numbers);
    let now = filled(above, &own.unwrap_or_default());
    let scaled: [f64; COEFFICIENTS] = std::array::from_fn(|at| now[at] * factors[at]);
    if scaled != now {
        edits.set(geom, "fluidcoef", &numbers(&scaled));
    }
}

/// The coefficients that the classes around a geom (of a body, or of a class) give, and whether any gives them.
fn inherited<'d>(model: &'d Mjcf<'d>, geom: Node<'d, 'd>) -> ([f64; COEFFICIENTS], bool) {
    let mut given = false;
    let mut now = DEFAULT;
    let levels = model.class_chain(geom).into_iter().flatten();
    for default in levels.filter(|default| default.has_tag_name("geom") && *default != geom) {
        if let Some(text) = default.attribute("fluidcoef") {
            now = filled(now, &parse_numbers(text));
            given = true;
        }
    }
    (now, given)
}

/// Numbers replaced from the left by those given.
fn filled(mut now: [f64; COEFFICIENTS], given: &[f64]) -> [f64; COEFFICIENTS] {
    for (now, given) in now.iter_mut().zip(given) {
        *now = *given;
    }
    now
}

/// Scales `density` or `viscosity` of `option`: the text, the old and the new value. `None` where the text has no such
/// attribute.
pub(super) fn scale_option(
    model: &Mjcf<'_>,
    key: &'static str,
    factor: f64,
) -> Option<(String, f64, f64)> {
    let option = model
        .sections("option")
        .filter(|option| option.has_attribute(key))
        .last()?;
    let was = model.setting_number("option", key);
    let now = was * factor;
    let mut edits = Edits::new(model.text);
    edits.set(option, key, &number(now));
    Some((edits.apply(), was, now))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::path::Path;

    use super::*;

    #[test]
    fn coefficients_are_scaled_where_they_are_said_or_take_effect() {
        let text = |values: [&str; 5]| {
            let [class, inner, own, part, alone] = values;
            format!(
                "<mujoco><default><default class=\"c\"><geom fluidcoef=\"{class}\"/><default class=\"d\">\
                 <geom fluidcoef=\"{inner}\"/></default></default><default class=\"e\"><geom \
                 fluidshape=\"ellipsoid\"{alone}/></default></default><worldbody><geom fluidcoef=\"{own}\"/>\
                 <geom class=\"c\" fluidcoef=\"{part}\"/><geom class=\"d\" fluidshape=\"ellipsoid\"/><geom/>\
                 <geom class=\"e\"/><geom fluidshape=\"ellipsoid\"{alone}/></worldbody></mujoco>"
            )
        };
        let nominal = text(["1 2 3 4 5", "7 8", "0 0 0 0 0", "9", ""]);
        let model = Mjcf::parse(&nominal, Path::new("m.xml")).unwrap();
        let scaled = scale(&model, [2.0, 1.0, 1.0, 1.0, 0.5]).unwrap();
        let alone = " fluidcoef=\"1 0.25 1.5 1 0.5\"";
        assert_eq!(
            scaled,
            text([
                "2 2 3 4 2.5",
                "14 8 3 4 2.5",
                "0 0 0 0 0",
                "18 2 3 4 2.5",
                alone
            ])
        );
        assert_eq!(scale(&model, [1.0; 5]).unwrap(), nominal);
    }

    #[test]
    fn an_attached_model_is_out_of_reach() {
        let text = "<mujoco><asset><model name=\"m\" file=\"m.xml\"/></asset></mujoco>";
        let model = Mjcf::parse(text, Path::new("m.xml")).unwrap();
        assert!(scale(&model, [2.0; 5]).unwrap_err().contains("attached"));
    }

    #[test]
    fn an_option_is_scaled_where_it_is_said_last() {
        let text = "<mujoco><option density=\"9\"/><option density=\"1000\"/><option/></mujoco>";
        let model = Mjcf::parse(text, Path::new("m.xml")).unwrap();
        let (scaled, was, now) = scale_option(&model, "density", 1.1).unwrap();
        assert!(scaled.contains("<option density=\"9\"/><option density=\"1100\"/>"));
        assert!(was == 1000.0 && (now - 1100.0).abs() < 1e-9);
        assert!(scale_option(&model, "viscosity", 1.1).is_none());
    }
}
