//! One text of a model and its included files, as MuJoCo reads it.
//!
//! MuJoCo replaces `<include file="..."/>` by the children of the included file's root. It looks for a file from the
//! folder of the model, then from that of the file that includes it.

use std::{
    fs,
    ops::Range,
    path::{Path, PathBuf},
};

use roxmltree::{Document, Node};

use super::{error::PatchError, xml_edit::Edits};

/// Deepest chain of includes: MuJoCo includes a file only once, so a deeper one is a loop.
const DEEPEST: usize = 32;

/// A model in one text.
#[derive(Debug)]
pub(super) struct Flat {
    /// The text.
    pub(super) text: String,
    /// Folder of the model, absolute.
    pub(super) folder: PathBuf,
    /// Parts of the text that stood in another folder, inner ones last.
    pub(super) parts: Vec<(Range<usize>, PathBuf)>,
}

impl Flat {
    /// Folder of the file that a place of the text is from.
    pub(super) fn folder_at(&self, at: usize) -> &Path {
        self.parts
            .iter()
            .rev()
            .find(|(range, _)| range.contains(&at))
            .map_or(&self.folder, |(_, folder)| folder)
    }
}

/// Reads a model and its included files.
pub(super) fn flatten(model: &Path) -> Result<Flat, PatchError> {
    let text = read(model, None)?;
    let path = fs::canonicalize(model).map_err(|source| PatchError::Read {
        path: model.to_owned(),
        included_by: None,
        source,
    })?;
    let folder = path.parent().map(Path::to_owned).unwrap_or_default();
    let (text, parts) = expand(&text, &path, &folder, 0)?;
    Ok(Flat {
        text,
        folder,
        parts,
    })
}

fn read(path: &Path, included_by: Option<&Path>) -> Result<String, PatchError> {
    let text =
        hydro_files::read_text(path, hydro_files::TEXT).map_err(|source| PatchError::Read {
            path: path.to_owned(),
            included_by: included_by.map(Path::to_owned),
            source,
        })?;
    // All byte order marks: a second would be taken off when the text is read again.
    Ok(text.trim_start_matches('\u{feff}').to_owned())
}

type Parts = Vec<(Range<usize>, PathBuf)>;

fn expand(
    text: &str,
    path: &Path,
    folder: &Path,
    depth: usize,
) -> Result<(String, Parts), PatchError> {
    let document = parse(text, path)?;
    let includes: Vec<Node<'_, '_>> = document
        .descendants()
        .filter(|node| node.has_tag_name("include"))
        .collect();
    let mut flat = String::with_capacity(text.len());
    let mut parts = Parts::new();
    let mut at = 0;
    for include in includes {
        let fault = |detail: String| PatchError::Xml {
            path: path.to_owned(),
            detail,
        };
        let file = include
            .attribute("file")
            .ok_or_else(|| fault("an <include> without `file`".to_owned()))?;
        if depth >= DEEPEST {
            return Err(fault(format!(
                "`{file}` is included {DEEPEST} files deep; do they include each other?"
            )));
        }
        let own = path.parent().unwrap_or(folder);
        let first = folder.join(file);
        let found = if first.exists() {
            first
        } else {
            own.join(file)
        };
        let (inner, inner_parts) = expand(&read(&found, Some(path))?, &found, folder, depth + 1)?;
        let (body, skipped) = inside_of_root(&inner, &found)?;
        let range = include.range();
        if range.start < at {
            continue;
        }
        flat.push_str(&text[at..range.start]);
        let start = flat.len();
        flat.push_str(body);
        if let Some(folder) = found.parent() {
            parts.push((start..flat.len(), folder.to_owned()));
        }
        parts.extend(inner_parts.into_iter().map(|(range, folder)| {
            let shift = |at: usize| (at + start).saturating_sub(skipped);
            (shift(range.start)..shift(range.end), folder)
        }));
        at = range.end;
    }
    flat.push_str(&text[at..]);
    Ok((flat, parts))
}

/// The text between the tags of the root, and its start.
fn inside_of_root<'a>(text: &'a str, path: &Path) -> Result<(&'a str, usize), PatchError> {
    let document = parse(text, path)?;
    let root = document.root_element();
    let mut children = root.children();
    let Some(first) = children.next() else {
        return Ok(("", 0));
    };
    let last = root.last_child().unwrap_or(first);
    let inside = &text[first.range().start..last.range().end];
    let start = first.range().start + (inside.len() - inside.trim_start().len());
    Ok((inside.trim(), start))
}

/// Reads a text as XML.
pub(super) fn parse<'a>(text: &'a str, path: &Path) -> Result<Document<'a>, PatchError> {
    Document::parse(text).map_err(|error| PatchError::Xml {
        path: path.to_owned(),
        detail: error.to_string(),
    })
}

/// Makes every file that the model names relative to itself an absolute path.
///
/// Meshes, height fields, skins and flex meshes are looked for in `meshdir`, textures in `texturedir`
/// (`assetdir` stands for both), then beside the file that includes them; attached models beside the model. Where possible
/// only the compiler's folder is made absolute: one line for all files.
pub(super) fn absolute_paths(flat: &Flat, path: &Path) -> Result<String, PatchError> {
    let document = parse(&flat.text, path)?;
    let root = document.root_element();
    let mut edits = Edits::new(&flat.text);
    let compilers: Vec<Node<'_, '_>> = root
        .children()
        .filter(|node| node.has_tag_name("compiler"))
        .collect();
    let last = |key| {
        compilers
            .iter()
            .rev()
            .find_map(|node| node.attribute(key).map(|value| (*node, value)))
    };
    let strips = last("strippath").is_some_and(|(_, value)| value == "true");
    let mut folders: Vec<(&str, PathBuf)> = Vec::new();
    for node in document.descendants().filter(Node::is_element) {
        for attribute in node
            .attributes()
            .filter(|attribute| is_file(attribute.name()))
        {
            let key = match (node.tag_name().name(), attribute.name()) {
                ("mesh" | "hfield" | "skin" | "flexcomp" | "flex", "file") => Some("meshdir"),
                ("texture", _) => Some("texturedir"),
                ("model", "file") => None,
                _ => continue,
            };
            let file = Path::new(attribute.value());
            if attribute.value().is_empty() || (file.is_absolute() && !strips) {
                continue;
            }
            let Some(key) = key else {
                let found = flat.folder.join(file);
                edits.set(node, "file", &found.to_string_lossy());
                continue;
            };
            let given = last(key).or_else(|| last("assetdir"));
            let folder = flat.folder.join(given.map_or("", |(_, folder)| folder));
            let inside = if strips {
                Path::new(file.file_name().unwrap_or_default())
            } else {
                file
            };
            let beside = flat.folder_at(node.range().start).join(file);
            if !strips && !folder.join(inside).exists() && beside.exists() {
                edits.set(node, attribute.name(), &beside.to_string_lossy());
            } else if !folders.iter().any(|(known, _)| *known == key) {
                folders.push((key, folder));
            }
        }
    }
    let mut missing = String::new();
    for (key, folder) in folders {
        let folder = folder.to_string_lossy().trim_end_matches('/').to_owned();
        match (last(key), compilers.last()) {
            (Some((node, _)), _) => edits.set(node, key, &folder),
            (None, Some(node)) => edits.set(*node, key, &folder),
            (None, None) => {
                missing.push(' ');
                missing.push_str(&super::xml_edit::attribute(key, &folder));
            }
        }
    }
    if !missing.is_empty() {
        edits.prepend(root, &format!("<compiler{missing}/>"));
    }
    Ok(edits.apply())
}

fn is_file(attribute: &str) -> bool {
    matches!(
        attribute,
        "file" | "fileright" | "fileleft" | "fileup" | "filedown" | "filefront" | "fileback"
    )
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn written(files: &[(&str, &str)]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in files {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        folder
    }

    #[test]
    fn included_files_take_the_place_of_their_element() {
        let folder = written(&[
            (
                "main.xml",
                "<mujoco>\n  <include file=\"sub/a.xml\"/>\n  <worldbody/>\n</mujoco>",
            ),
            (
                "sub/a.xml",
                "<mujocoinclude>\n  <option timestep=\"1\"/>\n  <include file=\"b.xml\"/>\n</mujocoinclude>",
            ),
            ("sub/b.xml", "<x><size nkey=\"1\"/></x>"),
        ]);
        let flat = flatten(&folder.path().join("main.xml")).unwrap();
        assert_eq!(
            flat.text,
            "<mujoco>\n  <option timestep=\"1\"/>\n  <size nkey=\"1\"/>\n  <worldbody/>\n</mujoco>"
        );
        assert_eq!(flat.parts.len(), 2);
        for (range, _) in &flat.parts {
            assert!(flat.text[range.clone()].contains("<size nkey=\"1\"/>"));
        }
        let at = flat.text.find("<size").unwrap();
        assert!(flat.folder_at(at).ends_with("sub"));
        assert!(!flat.folder_at(0).ends_with("sub"));
    }

    #[test]
    fn a_missing_include_and_a_loop_are_named() {
        let folder = written(&[
            ("main.xml", "<mujoco><include file=\"none.xml\"/></mujoco>"),
            ("loop.xml", "<mujoco><include file=\"loop.xml\"/></mujoco>"),
            ("bare.xml", "<mujoco><include/></mujoco>"),
            ("open.xml", "<mujoco>"),
        ]);
        let text = |name: &str| flatten(&folder.path().join(name)).unwrap_err().to_string();
        let missing = text("main.xml");
        assert!(
            missing.contains("none.xml") && missing.contains("included by"),
            "{missing}"
        );
        assert!(text("loop.xml").contains("include each other"));
        assert!(text("bare.xml").contains("without `file`"));
        assert!(text("open.xml").contains("open.xml"));
        assert!(text("absent.xml").contains("absent.xml"));
    }

    fn absolute(folder: &tempfile::TempDir) -> String {
        let path = folder.path().join("main.xml");
        absolute_paths(&flatten(&path).unwrap(), &path).unwrap()
    }

    #[test]
    fn the_folder_of_meshes_becomes_absolute() {
        let folder = written(&[(
            "main.xml",
            "<mujoco>\n  <compiler meshdir=\"m\"/>\n  <asset><mesh file=\"a.obj\"/></asset>\n</mujoco>",
        )]);
        let root = fs::canonicalize(folder.path()).unwrap();
        let text = absolute(&folder);
        let expected = format!("meshdir=\"{}\"", root.join("m").display());
        assert!(
            text.contains(&expected) && text.contains("file=\"a.obj\""),
            "{text}"
        );
    }

    #[test]
    fn a_model_without_a_compiler_gets_one() {
        let folder = written(&[(
            "main.xml",
            "<mujoco>\n  <asset><texture file=\"a.png\"/><mesh file=\"/x/b.obj\"/></asset>\n</mujoco>",
        )]);
        let root = fs::canonicalize(folder.path()).unwrap();
        let text = absolute(&folder);
        let expected = format!("<compiler texturedir=\"{}\"/>", root.display());
        assert!(
            text.contains(&expected) && text.contains("/x/b.obj"),
            "{text}"
        );
    }

    #[test]
    fn a_mesh_beside_its_included_file_is_found_there() {
        let folder = written(&[
            ("main.xml", "<mujoco><include file=\"sub/i.xml\"/></mujoco>"),
            (
                "sub/i.xml",
                "<x><asset><mesh file=\"a.obj\"/><model file=\"k.xml\"/></asset></x>",
            ),
            ("sub/a.obj", ""),
        ]);
        let root = fs::canonicalize(folder.path()).unwrap();
        let text = absolute(&folder);
        assert!(
            text.contains(&format!("file=\"{}\"", root.join("sub/a.obj").display())),
            "{text}"
        );
        assert!(
            text.contains(&format!("file=\"{}\"", root.join("k.xml").display())),
            "{text}"
        );
    }

    #[test]
    fn a_model_without_files_stays_as_it_is() {
        let text = "<mujoco><!-- kept --><worldbody/></mujoco>";
        let folder = written(&[("main.xml", text)]);
        assert_eq!(absolute(&folder), text);
    }
}
