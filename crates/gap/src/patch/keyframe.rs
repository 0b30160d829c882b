//! Key frames of a model with a new coordinate.

use roxmltree::Node;

use super::xml_edit::Edits;

/// Puts a zero into a list of numbers of a key frame, if it has that list.
pub(super) fn insert_zero(edits: &mut Edits<'_>, key: Node<'_, '_>, list: &str, at: usize) {
    let Some(text) = key.attribute(list) else {
        return;
    };
    let mut words: Vec<&str> = text.split_whitespace().collect();
    if words.is_empty() {
        return;
    }
    words.insert(at.min(words.len()), "0");
    edits.set(key, list, &words.join(" "));
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn a_zero_is_put_where_the_coordinate_stands() {
        let text = "<key qpos=\"1 2  3\" act=\"\"/>";
        let document = roxmltree::Document::parse(text).unwrap();
        let mut edits = Edits::new(text);
        insert_zero(&mut edits, document.root_element(), "qpos", 1);
        insert_zero(&mut edits, document.root_element(), "qvel", 1);
        insert_zero(&mut edits, document.root_element(), "act", 1);
        assert_eq!(edits.apply(), "<key qpos=\"1 0 2 3\" act=\"\"/>");
    }
}
