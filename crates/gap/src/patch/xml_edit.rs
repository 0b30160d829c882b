//! Changes of an XML text in place: every other byte stays, comments too.

use std::ops::Range;

use roxmltree::Node;

/// One more level of indentation.
const INDENT: &str = "  ";

/// Changes of a text, by byte ranges that do not overlap.
#[derive(Debug)]
pub(super) struct Edits<'a> {
    text: &'a str,
    changes: Vec<(Range<usize>, String)>,
}

impl<'a> Edits<'a> {
    pub(super) fn new(text: &'a str) -> Self {
        Self {
            text,
            changes: Vec::new(),
        }
    }

    /// The changed text. Changes at one place keep their order.
    pub(super) fn apply(mut self) -> String {
        self.changes.sort_by_key(|(range, _)| range.start);
        let mut changed = String::with_capacity(self.text.len() + 256);
        let mut at = 0;
        for (range, replacement) in &self.changes {
            if range.start < at {
                continue;
            }
            changed.push_str(&self.text[at..range.start]);
            changed.push_str(replacement);
            at = range.end;
        }
        changed.push_str(&self.text[at..]);
        changed
    }

    pub(super) fn replace(&mut self, range: Range<usize>, replacement: String) {
        self.changes.push((range, replacement));
    }

    /// Sets an attribute, existing or new.
    pub(super) fn set(&mut self, node: Node<'_, '_>, key: &str, value: &str) {
        let written = attribute(key, value);
        match node.attribute_node(key) {
            Some(found) => self.replace(found.range(), written),
            None => {
                let at = attributes_end(node);
                self.replace(at..at, format!(" {written}"));
            }
        }
    }

    /// Removes an attribute and the space before it.
    pub(super) fn unset(&mut self, node: Node<'_, '_>, key: &str) {
        if let Some(found) = node.attribute_node(key) {
            let range = found.range();
            let before = self.text[..range.start].trim_end().len();
            self.replace(before..range.end, String::new());
        }
    }

    /// Removes an element, with its line where it stands alone on it.
    pub(super) fn remove(&mut self, node: Node<'_, '_>) {
        let range = node.range();
        let indented = indentation(self.text, node);
        let before = indented.map_or(0, |indent| indent.len() + 1);
        self.replace(range.start - before..range.end, String::new());
    }

    /// Gives an element another name.
    pub(super) fn rename(&mut self, node: Node<'_, '_>, tag: &str) {
        let range = node.range();
        let old = node.tag_name().name();
        self.replace(range.start + 1..range.start + 1 + old.len(), tag.to_owned());
        if !self.text[range.clone()].ends_with("/>")
            && let Some(at) = self.text[range.clone()].rfind("</")
        {
            let at = range.start + at + 2;
            self.replace(at..at + old.len(), tag.to_owned());
        }
    }

    /// Puts an element, one or more lines, behind another.
    pub(super) fn after(&mut self, node: Node<'_, '_>, element: &str) {
        let indent = indentation(self.text, node);
        let at = node.range().end;
        self.replace(at..at, lines(element, indent.as_deref()));
    }

    /// Puts an element in front of the elements of another, below its start tag.
    pub(super) fn prepend(&mut self, parent: Node<'_, '_>, element: &str) {
        match parent.first_element_child() {
            Some(first) => {
                let at = first.range().start;
                let written = match indentation(self.text, first) {
                    Some(indent) => {
                        let below = lines(element, Some(&indent));
                        format!("{}\n{indent}", below.trim_start())
                    }
                    None => lines(element, None),
                };
                self.replace(at..at, written);
            }
            None => self.append(parent, element),
        }
    }

    /// Puts an element last into another.
    pub(super) fn append(&mut self, parent: Node<'_, '_>, element: &str) {
        let range = parent.range();
        if let Some(last) = parent.children().rfind(Node::is_element) {
            return self.after(last, element);
        }
        let outer = indentation(self.text, parent);
        let inner = outer.as_ref().map(|outer| format!("{outer}{INDENT}"));
        let close = outer.map(|outer| format!("\n{outer}")).unwrap_or_default();
        let written = lines(element, inner.as_deref());
        if self.text[range.clone()].ends_with("/>") {
            let tag = parent.tag_name().name();
            let start = self.text[..range.end - 2].trim_end().len();
            self.replace(start..range.end, format!(">{written}{close}</{tag}>"));
        } else if let Some(at) = self.text[range.clone()].rfind("</") {
            // An element without elements may still hold comments: they stay.
            let at = range.start + at;
            let before = self.text[..at]
                .trim_end_matches([' ', '\t', '\n', '\r'])
                .len();
            self.replace(before..at, format!("{written}{close}"));
        }
    }
}

/// Where the attributes of a start tag end.
fn attributes_end(node: Node<'_, '_>) -> usize {
    node.attributes()
        .map(|attribute| attribute.range().end)
        .max()
        .unwrap_or(node.range().start + 1 + node.tag_name().name().len())
}

/// The white space before an element that starts its line.
fn indentation(text: &str, node: Node<'_, '_>) -> Option<String> {
    let before = &text[..node.range().start];
    let line = &before[before.rfind('\n')? + 1..];
    line.chars()
        .all(|c| c == ' ' || c == '\t')
        .then(|| line.to_owned())
}

/// Lines with an indentation, each on a line of its own; on one line without one.
fn lines(element: &str, indent: Option<&str>) -> String {
    match indent {
        Some(indent) => element
            .lines()
            .map(|line| format!("\n{indent}{line}"))
            .collect(),
        None => element.lines().map(str::trim).collect(),
    }
}

/// `key="value"`, in single quotes where the value has double ones.
pub(super) fn attribute(key: &str, value: &str) -> String {
    let escaped = value.replace('&', "&amp;").replace('<', "&lt;");
    if escaped.contains('"') {
        format!("{key}='{}'", escaped.replace('\'', "&apos;"))
    } else {
        format!("{key}=\"{escaped}\"")
    }
}

/// A number as a person would write it: twelve significant digits.
pub(super) fn number(value: f64) -> String {
    let rounded: f64 = format!("{value:.11e}").parse().unwrap_or(value);
    if rounded == 0.0 {
        "0".to_owned()
    } else if (1e-4..1e9).contains(&rounded.abs()) {
        format!("{rounded}")
    } else {
        format!("{rounded:e}")
    }
}

/// Numbers with spaces between.
pub(super) fn numbers(values: &[f64]) -> String {
    let words: Vec<String> = values.iter().map(|value| number(*value)).collect();
    words.join(" ")
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn changed(text: &str, change: impl Fn(&mut Edits<'_>, Node<'_, '_>)) -> String {
        let document = roxmltree::Document::parse(text).unwrap();
        let mut edits = Edits::new(text);
        change(&mut edits, document.root_element());
        edits.apply()
    }

    #[test]
    fn an_attribute_is_set_and_taken_away() {
        let set = |text| changed(text, |edits, root| edits.set(root, "b", "2"));
        assert_eq!(set("<a/>"), "<a b=\"2\"/>");
        assert_eq!(set("<a b='1' c='3'></a>"), "<a b=\"2\" c='3'></a>");
        let unset = changed("<a  b='1' c='3'/>", |edits, root| edits.unset(root, "b"));
        assert_eq!(unset, "<a c='3'/>");
        let quoted = changed("<a/>", |edits, root| edits.set(root, "b", "\"<'&"));
        assert_eq!(quoted, "<a b='\"&lt;&apos;&amp;'/>");
    }

    #[test]
    fn an_element_is_taken_away_with_its_line() {
        let removed = |text| {
            changed(text, |edits, root| {
                edits.remove(root.first_element_child().unwrap());
            })
        };
        assert_eq!(removed("<a>\n  <b/>\n  <c/>\n</a>"), "<a>\n  <c/>\n</a>");
        assert_eq!(removed("<a><b/><c/></a>"), "<a><c/></a>");
        assert_eq!(removed("<a>\r\n  <b/></a>"), "<a>\r</a>");
    }

    #[test]
    fn a_tag_is_renamed_at_both_ends() {
        let rename = |text| changed(text, |edits, root| edits.rename(root, "bc"));
        assert_eq!(rename("<a x=''/>"), "<bc x=''/>");
        assert_eq!(rename("<a><a/></a>"), "<bc><a/></bc>");
    }

    #[test]
    fn a_child_takes_the_indentation_of_the_place() {
        let append = |text| changed(text, |edits, root| edits.append(root, "<n>\n  <m/>\n</n>"));
        assert_eq!(append("<a/>"), "<a><n><m/></n></a>");
        assert_eq!(append("<a><b/></a>"), "<a><b/><n><m/></n></a>");
        assert_eq!(
            append("<a>\n    <b/>\n</a>"),
            "<a>\n    <b/>\n    <n>\n      <m/>\n    </n>\n</a>"
        );
        let inner = |text: &str| {
            changed(text, |edits, root| {
                edits.append(root.first_element_child().unwrap(), "<n/>");
            })
        };
        assert_eq!(
            inner("<a>\n  <b c='1' />\n</a>"),
            "<a>\n  <b c='1'>\n    <n/>\n  </b>\n</a>"
        );
        assert_eq!(
            inner("<a>\n  <b><!-- kept -->\n  </b>\n</a>"),
            "<a>\n  <b><!-- kept -->\n    <n/>\n  </b>\n</a>"
        );
        let prepend = |text| changed(text, |edits, root| edits.prepend(root, "<n/>"));
        assert_eq!(prepend("<a>\n  <b/>\n</a>"), "<a>\n  <n/>\n  <b/>\n</a>");
        assert_eq!(prepend("<a><b/></a>"), "<a><n/><b/></a>");
    }

    #[test]
    fn numbers_are_short_and_read_back() {
        assert_eq!(numbers(&[0.0, -0.1, 1e-14, 2.5e12]), "0 -0.1 1e-14 2.5e12");
        assert_eq!(number(0.1 + 0.2), "0.3");
        assert_eq!(number(1.0 / 3.0), "0.333333333333");
        assert_eq!(number(1e-4), "0.0001");
    }
}
