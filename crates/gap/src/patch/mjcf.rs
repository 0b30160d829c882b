//! A parsed MJCF: its elements by name, and their attributes after default classes.

use std::path::Path;

use roxmltree::{Document, Node};

use super::error::PatchError;

/// Elements of the section `actuator`, as of MuJoCo 4.0.0; in a default class they share one set of defaults.
pub(super) const ACTUATORS: [&str; 13] = [
    "general",
    "motor",
    "position",
    "velocity",
    "intvelocity",
    "orientation",
    "pid",
    "damper",
    "cylinder",
    "muscle",
    "adhesion",
    "dcmotor",
    "plugin",
];

/// A parsed model.
#[derive(Debug)]
pub(super) struct Mjcf<'a> {
    /// The text.
    pub(super) text: &'a str,
    document: Document<'a>,
}

impl<'a> Mjcf<'a> {
    /// Parses the text of the file `path`.
    pub(super) fn parse(text: &'a str, path: &Path) -> Result<Self, PatchError> {
        let document = super::flatten::parse(text, path)?;
        let found = document.root_element().tag_name().name();
        if found != "mujoco" {
            return Err(PatchError::Xml {
                path: path.to_owned(),
                detail: format!("its root is <{found}>, expected <mujoco>"),
            });
        }
        Ok(Self { text, document })
    }

    pub(super) fn root(&self) -> Node<'_, 'a> {
        self.document.root_element()
    }

    /// Every element of a section, first to last.
    pub(super) fn section(&self, name: &'static str) -> impl Iterator<Item = Node<'_, 'a>> {
        self.sections(name)
            .flat_map(|section| section.children().filter(Node::is_element))
    }

    /// Every section of a name; MuJoCo lets one stand many times.
    pub(super) fn sections(&self, name: &'static str) -> impl Iterator<Item = Node<'_, 'a>> {
        self.root()
            .children()
            .filter(move |node| node.has_tag_name(name))
    }

    /// The last value that a section's attribute is given.
    pub(super) fn setting(&self, section: &'static str, key: &str) -> Option<&str> {
        self.sections(section)
            .filter_map(|node| node.attribute(key))
            .last()
    }

    /// A number of a section; zero where it is not given.
    pub(super) fn setting_number(&self, section: &'static str, key: &str) -> f64 {
        self.setting(section, key)
            .and_then(|text| parse_numbers(text).first().copied())
            .unwrap_or(0.0)
    }

    /// Every element of a name, in order, wherever it stands.
    pub(super) fn elements(&self, tag: &'static str) -> impl Iterator<Item = Node<'_, 'a>> {
        self.root()
            .descendants()
            .filter(move |node| node.has_tag_name(tag))
    }

    /// Elements below the world, in order.
    fn below_world(&self) -> impl Iterator<Item = Node<'_, 'a>> {
        self.sections("worldbody")
            .flat_map(|world| world.descendants().filter(Node::is_element))
    }

    pub(super) fn bodies(&self) -> impl Iterator<Item = Node<'_, 'a>> {
        self.below_world().filter(|node| node.has_tag_name("body"))
    }

    /// Joints of bodies; not those inside a composite.
    pub(super) fn joints(&self) -> impl Iterator<Item = Node<'_, 'a>> {
        self.below_world().filter(|node| {
            node.has_tag_name("joint")
                && node.parent().is_some_and(|parent| {
                    ["body", "frame"]
                        .iter()
                        .any(|tag| parent.has_tag_name(*tag))
                })
        })
    }

    pub(super) fn sites(&self) -> impl Iterator<Item = Node<'_, 'a>> {
        self.below_world().filter(|node| node.has_tag_name("site"))
    }

    /// The body around an element, or the element itself.
    pub(super) fn body_around<'d>(node: Node<'d, 'a>) -> Option<Node<'d, 'a>> {
        node.ancestors().find(|node| node.has_tag_name("body"))
    }

    /// The body that hangs on the world above an element, or the element itself.
    pub(super) fn base_above<'d>(node: Node<'d, 'a>) -> Option<Node<'d, 'a>> {
        node.ancestors()
            .filter(|node| node.has_tag_name("body"))
            .last()
    }

    /// True where any element has this name.
    pub(super) fn is_named(&self, name: &str) -> bool {
        self.document
            .descendants()
            .any(|node| node.attribute("name") == Some(name))
    }

    /// A name that no element has yet.
    pub(super) fn fresh_name(&self, wanted: &str) -> String {
        let mut name = wanted.to_owned();
        let mut count = 2;
        while self.is_named(&name) {
            name = format!("{wanted}_{count}");
            count += 1;
        }
        name
    }

    /// An attribute of an element, or what its default class gives it.
    pub(super) fn attribute<'d>(&'d self, node: Node<'d, 'a>, key: &str) -> Option<&'d str> {
        node.attribute(key).or_else(|| self.inherited(node, key))
    }

    /// An attribute's value in the default class of an element.
    pub(super) fn inherited<'d>(&'d self, node: Node<'d, 'a>, key: &str) -> Option<&'d str> {
        let tag = node.tag_name().name();
        self.class_chain(node)
            .into_iter()
            .flatten()
            .filter(|default| same_default(default.tag_name().name(), tag))
            .filter_map(|default| default.attribute(key))
            .next_back()
    }

    /// Numbers of an attribute or of its default; none where it is not given.
    pub(super) fn attribute_numbers<'d>(&'d self, node: Node<'d, 'a>, key: &str) -> Vec<f64> {
        self.attribute(node, key)
            .map(parse_numbers)
            .unwrap_or_default()
    }

    /// One number of an attribute or of its default; zero where there is none.
    pub(super) fn attribute_number<'d>(&'d self, node: Node<'d, 'a>, key: &str) -> f64 {
        self.attribute_numbers(node, key)
            .first()
            .copied()
            .unwrap_or(0.0)
    }

    /// The numbers of an attribute after every class, outermost first; each replaces those before it from the left.
    pub(super) fn merged_numbers<'d>(&'d self, node: Node<'d, 'a>, key: &str) -> Vec<f64> {
        let tag = node.tag_name().name();
        let mut merged: Vec<f64> = Vec::new();
        let defaults = self.class_chain(node).into_iter().flatten();
        for element in defaults
            .filter(|default| same_default(default.tag_name().name(), tag))
            .chain([node])
        {
            let given = element
                .attribute(key)
                .map(parse_numbers)
                .unwrap_or_default();
            if given.len() >= merged.len() {
                merged = given;
            } else {
                merged[..given.len()].copy_from_slice(&given);
            }
        }
        merged
    }

    /// Elements of the default classes that hold for an element, outermost class first. For an element of a class these are
    /// the classes around it and its own.
    pub(super) fn class_chain<'d>(&'d self, node: Node<'d, 'a>) -> Vec<Vec<Node<'d, 'a>>> {
        let elements = |default: Node<'d, 'a>| {
            default
                .children()
                .filter(|child| child.is_element() && !child.has_tag_name("default"))
        };
        let main = self.sections("default").flat_map(elements).collect();
        let mut chain: Vec<Vec<Node<'d, 'a>>> = vec![main];
        let class = node.attribute("class").or_else(|| {
            node.ancestors()
                .skip(1)
                .find_map(|above| above.attribute("childclass"))
        });
        let around = node.ancestors().find(|node| node.has_tag_name("default"));
        let found = around.or_else(|| {
            self.sections("default")
                .flat_map(|top| top.descendants())
                .find(|node| node.has_tag_name("default") && node.attribute("class") == class)
                .filter(|_| class.is_some())
        });
        // The outermost default is the main class, which is there already.
        let inner = |above: &Node<'d, 'a>| {
            above.has_tag_name("default")
                && above
                    .parent()
                    .is_some_and(|parent| parent.has_tag_name("default"))
        };
        let mut levels: Vec<Node<'d, 'a>> = found
            .iter()
            .flat_map(|found| found.ancestors().filter(inner))
            .collect();
        levels.reverse();
        chain.extend(levels.into_iter().map(|level| elements(level).collect()));
        chain
    }
}

/// True where a default of one element holds for another: all actuators share theirs.
fn same_default(default: &str, tag: &str) -> bool {
    default == tag || (ACTUATORS.contains(&default) && ACTUATORS.contains(&tag))
}

/// The leading numbers of an attribute.
pub(super) fn parse_numbers(text: &str) -> Vec<f64> {
    text.split_whitespace()
        .map_while(|word| word.parse().ok())
        .collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    const MODEL: &str = r#"<mujoco>
      <default>
        <joint damping="1" armature="0.1"/>
        <default class="leg"><joint damping="2"/><default class="shin"><joint damping="3 4"/></default></default>
      </default>
      <worldbody>
        <body name="a"><joint name="plain"/>
          <body name="b" childclass="leg"><frame><joint name="child"/></frame>
            <body name="c"><joint name="own" class="shin"/><joint name="said" class="shin" damping="9"/></body>
          </body>
        </body>
      </worldbody>
      <equality><joint joint1="plain" name="none"/></equality>
    </mujoco>"#;

    fn joint<'d>(model: &'d Mjcf<'d>, name: &str) -> Node<'d, 'd> {
        model
            .joints()
            .find(|node| node.attribute("name") == Some(name))
            .unwrap()
    }

    #[test]
    fn classes_are_followed_inwards() {
        let model = Mjcf::parse(MODEL, Path::new("m.xml")).unwrap();
        for (name, expected) in [
            ("plain", "1"),
            ("child", "2"),
            ("own", "3 4"),
            ("said", "9"),
        ] {
            let node = joint(&model, name);
            assert_eq!(model.attribute(node, "damping"), Some(expected), "{name}");
            assert_eq!(model.attribute_number(node, "armature"), 0.1);
        }
        assert_eq!(model.joints().count(), 4);
        let said = joint(&model, "said");
        assert_eq!(model.merged_numbers(said, "damping"), [9.0, 4.0]);
        let shin = model.elements("joint").nth(2).unwrap();
        assert_eq!(model.class_chain(shin).len(), 3);
        let base = Mjcf::base_above(joint(&model, "own")).unwrap();
        assert_eq!(base.attribute("name"), Some("a"));
        assert_eq!(model.fresh_name("b"), "b_2");
        assert_eq!(model.fresh_name("z"), "z");
    }

    #[test]
    fn only_an_mjcf_is_read() {
        let text = Mjcf::parse("<robot/>", Path::new("m.urdf"))
            .unwrap_err()
            .to_string();
        assert!(
            text.contains("<robot>") && text.contains("m.urdf"),
            "{text}"
        );
    }
}
