//! Arranges the declarations of cbindgen into the headers of `include/`: by subject, each type before its first
//! function.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

/// Maximum line length of a header.
pub const WIDTH: usize = 100;

const LAYOUT: &str = include_str!("layout.txt");
const OVERVIEW: &str = include_str!("overview.txt");

/// Constants that are an enumeration in C: its name, the prefix of its constants and its comment.
const ENUMS: [(&str, &str, &str); 16] = [
    (
        "sinew_status_code",
        "SINEW_STATUS_",
        "Status codes that a call returns.",
    ),
    (
        "sinew_kernel",
        "SINEW_KERNEL_",
        "SIMD level of the kernels that step springs and nodes.",
    ),
    (
        "sinew_storage",
        "SINEW_STORAGE_",
        "Memory layout of the springs of a body.",
    ),
    ("sinew_solver", "SINEW_SOLVER_", "Time integrator of a body."),
    (
        "sinew_limit",
        "SINEW_LIMIT_",
        "Limit of the substep of a step that was refused.",
    ),
    (
        "sinew_material",
        "SINEW_MATERIAL_",
        "Source of the forces between the nodes of elements.",
    ),
    (
        "sinew_spring_law",
        "SINEW_SPRING_LAW_",
        "Force law of springs under a strain e.",
    ),
    (
        "sinew_element_law",
        "SINEW_ELEMENT_LAW_",
        "Hyperelastic law of finite elements.",
    ),
    (
        "sinew_preset",
        "SINEW_PRESET_",
        "Tissues with values from the literature.",
    ),
    ("sinew_shape", "SINEW_SHAPE_", "Shape of a tool."),
    (
        "sinew_detection",
        "SINEW_DETECTION_",
        "Method that finds contacts or overlaps.",
    ),
    ("sinew_mesh_format", "SINEW_MESH_FORMAT_", "File format of a mesh."),
    ("sinew_colours", "SINEW_COLOURS_", "Color map of values."),
    (
        "sinew_image_form",
        "SINEW_IMAGE_FORM_",
        "Contents of the images of a detector.",
    ),
    (
        "sinew_log_level",
        "SINEW_LOG_",
        "Messages that a log callback receives.",
    ),
    (
        "sinew_draw_flags",
        "SINEW_DRAW_",
        "What sinew_world_debug_draw draws; flags to be added.",
    ),
];

/// A file of `include/`.
pub struct Header {
    pub path: String,
    pub text: String,
}

/// The code after a comment: a line of C and, for a struct or an enumeration, its members.
#[derive(Default)]
struct Item {
    comment: Vec<String>,
    code: String,
    members: Vec<(Vec<String>, String)>,
}

/// Returns the paragraphs of a C comment: those before the Rust sections.
fn paragraphs(lines: &[&str]) -> Vec<String> {
    let lines = lines
        .iter()
        .map(|line| line.trim_start().trim_start_matches('/').trim());
    let mut paragraphs = vec![String::new()];
    for line in lines.take_while(|line| !line.starts_with("# ")) {
        match (line.is_empty(), paragraphs.last_mut()) {
            (false, Some(last)) => {
                last.push_str(if last.is_empty() { "" } else { " " });
                last.push_str(line);
            }
            _ => paragraphs.push(String::new()),
        }
    }
    paragraphs.retain(|paragraph| !paragraph.is_empty());
    paragraphs
}

fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|letter: char| !(letter.is_ascii_alphanumeric() || letter == '_'))
}

/// Returns the name that a line of C declares.
fn name_of(code: &str) -> &str {
    if let Some(rest) = code.strip_prefix("#define ") {
        return rest.split(' ').next().unwrap_or_default();
    }
    if let Some((_, rest)) = code.split_once("(*") {
        return rest.split(')').next().unwrap_or_default();
    }
    let head = code.split(['(', ';', '{']).next().unwrap_or_default();
    words(head).filter(|word| !word.is_empty()).last().unwrap_or_default()
}

/// Returns the declarations of cbindgen by name; constants of an enumeration are its members.
fn items(declared: &str) -> BTreeMap<String, Item> {
    let mut items = BTreeMap::<String, Item>::new();
    let mut comment = Vec::new();
    let mut members = None;
    for line in declared.lines().filter(|line| !line.is_empty()) {
        if line.trim_start().starts_with("///") {
            comment.push(line);
            continue;
        }
        let code = line.trim().replace("struct sinew_", "sinew_");
        let comment = paragraphs(&std::mem::take(&mut comment));
        let name = name_of(&code).to_owned();
        match &mut members {
            Some(_) if code.starts_with('}') => members = None,
            Some(owner) => {
                let owner: &mut Item = items.get_mut::<String>(owner).expect("a struct that began");
                owner.members.push((comment, code));
            }
            None => {
                let enumeration = ENUMS.iter().find(|(_, prefix, _)| name.starts_with(prefix));
                if let (true, Some((owner, _, about))) = (code.starts_with('#'), enumeration) {
                    let owner = items.entry((*owner).to_owned()).or_insert_with(|| Item {
                        comment: vec![(*about).to_owned()],
                        code: format!("typedef enum {owner}"),
                        members: Vec::new(),
                    });
                    let value = code.rsplit(' ').next().unwrap_or_default();
                    owner.members.push((comment, format!("{name} = {value}")));
                    continue;
                }
                let code = match code.strip_suffix(" {") {
                    Some(head) => {
                        members = Some(name.clone());
                        head.replace("typedef ", "typedef struct ")
                    }
                    None if code.starts_with("typedef sinew_") => code.replace("typedef ", "typedef struct "),
                    None => code,
                };
                let item = Item {
                    comment,
                    code,
                    members: Vec::new(),
                };
                assert!(items.insert(name.clone(), item).is_none(), "{name} is declared twice");
            }
        }
    }
    items
}

/// Wraps pieces to lines of at most [`WIDTH`], the first after `first` and the others after `next`.
fn wrap<'a>(pieces: impl Iterator<Item = &'a str>, first: &str, next: &str) -> String {
    let mut lines = vec![first.to_owned()];
    let mut is_empty = true;
    for piece in pieces {
        let line = lines.last_mut().expect("a line");
        if is_empty || line.len() + 1 + piece.len() <= WIDTH {
            *line += if is_empty { "" } else { " " };
            *line += piece;
        } else {
            lines.push(format!("{next}{piece}"));
        }
        is_empty = false;
    }
    lines.iter().map(|line| format!("{}\n", line.trim_end())).collect()
}

fn comment(paragraphs: &[String], indent: &str) -> String {
    let start = format!("{indent}/// ");
    paragraphs
        .iter()
        .map(|text| wrap(text.split_whitespace(), &start, &start))
        .collect()
}

/// Returns code with its comment: after it, in this column, if there is room, else above.
fn commented(code: &str, paragraphs: &[String], indent: &str, column: usize) -> String {
    if let [text] = paragraphs {
        let code = format!("{indent}{code}  ");
        for line in [format!("{code:column$}///< {text}\n"), format!("{code}///< {text}\n")] {
            if line.len() <= WIDTH + 1 {
                return line;
            }
        }
    }
    format!("{}{indent}{code}\n", comment(&[paragraphs.join(" ")], indent))
}

impl Item {
    fn is_constant(&self) -> bool {
        self.code.starts_with('#')
    }

    fn text(&self, name: &str) -> String {
        if self.is_constant() {
            return commented(&self.code, &self.comment, "", 0);
        }
        let mut text = comment(&self.comment, "");
        if self.members.is_empty() {
            let Some((head, arguments)) = self.code.split_once('(').filter(|_| !self.code.starts_with("typedef"))
            else {
                return text + &wrap(self.code.split_whitespace(), "", "    ");
            };
            let pieces = arguments.split_inclusive(',').map(str::trim_start);
            return text + &wrap(pieces, &format!("{head}("), "    ");
        }
        let is_enum = self.code.starts_with("typedef enum");
        let last = self.members.len() - 1;
        let end = |index| if is_enum && index < last { "," } else { "" };
        let codes = self
            .members
            .iter()
            .enumerate()
            .map(|(i, (_, code))| format!("{code}{}", end(i)));
        let codes: Vec<String> = codes.collect();
        let longest = codes.iter().map(String::len).filter(|length| *length <= 34).max();
        let column = longest.unwrap_or(0) + 4;
        writeln!(text, "{} {{", self.code).expect("a string");
        for (code, (paragraphs, _)) in codes.iter().zip(&self.members) {
            text += &commented(code, paragraphs, "  ", column);
        }
        writeln!(text, "}} {name};").expect("a string");
        text
    }
}

/// One header of the layout during arrangement.
#[derive(Default)]
struct Part {
    name: String,
    introduction: String,
    content: String,
    includes: BTreeSet<String>,
    ends_with_constant: bool,
}

struct Arranger {
    items: BTreeMap<String, Item>,
    /// The header of each placed item.
    placed: BTreeMap<String, String>,
}

impl Arranger {
    /// Returns the items that must precede an item: its member types, and constants that its comments name.
    fn needed(&self, name: &str) -> Vec<String> {
        let item = &self.items[name];
        let members = item.members.iter();
        let code = members.clone().map(|(_, code)| code).chain([&item.code]);
        let types = code
            .flat_map(|code| words(code))
            .filter(|word| self.items.contains_key(*word));
        let comments = members.flat_map(|(comment, _)| comment).chain(&item.comment);
        let constants = comments.flat_map(|text| words(text)).filter_map(|word| {
            let enumeration = ENUMS
                .iter()
                .find(|(owner, prefix, _)| *owner == word || word.starts_with(prefix));
            let constant = self.items.get(word).filter(|item| item.is_constant()).map(|_| word);
            enumeration.map(|(owner, ..)| *owner).or(constant)
        });
        types
            .chain(constants)
            .filter(|needed| *needed != name)
            .map(str::to_owned)
            .collect()
    }

    fn place(&mut self, name: &str, part: &mut Part) {
        if let Some(header) = self.placed.get(name) {
            if *header != part.name {
                part.includes.insert(header.clone());
            }
            return;
        }
        self.placed.insert(name.to_owned(), part.name.clone());
        for needed in self.needed(name) {
            self.place(&needed, part);
        }
        let item = &self.items[name];
        let continues = part.ends_with_constant && item.is_constant();
        part.content += if continues { "" } else { "\n" };
        part.content += &item.text(name);
        part.ends_with_constant = item.is_constant();
    }
}

/// Formats text as line comments; lines that begin with spaces are list entries.
fn prose(text: &str) -> String {
    let lines = text.lines().map(|line| match line.strip_prefix("  ") {
        // A table is unchanged.
        Some(entry) if entry.contains("  ") => format!("//   {entry}\n"),
        Some(entry) => wrap(entry.split_whitespace(), "//   ", "//     "),
        None => wrap(line.split_whitespace(), "// ", "// "),
    });
    lines.collect()
}

fn guard(name: &str) -> String {
    format!("SINEW_{}_H", name.to_uppercase())
}

fn parts(items: BTreeMap<String, Item>) -> Vec<Part> {
    let mut arranger = Arranger {
        items,
        placed: BTreeMap::new(),
    };
    let mut parts = Vec::<Part>::new();
    // After the explanation of the file format.
    let lines = LAYOUT.lines().skip_while(|line| !line.starts_with("header "));
    for line in lines.filter(|line| !line.is_empty()) {
        if let Some(rest) = line.strip_prefix("header ") {
            let (name, about) = rest.split_once(": ").expect("a header has a subject");
            parts.push(Part {
                name: name.to_owned(),
                introduction: format!("sinew/{name}.h: {about}.\n"),
                ..Part::default()
            });
            continue;
        }
        let part = parts.last_mut().expect("a header");
        let name = line.strip_prefix("type ").unwrap_or(line);
        if let Some(title) = line.strip_prefix("section ") {
            part.content += &format!("\n// ---- {title} {}\n", "-".repeat(WIDTH - 9 - title.len()));
            part.ends_with_constant = false;
        } else if arranger.items.contains_key(name) {
            arranger.place(name, part);
        } else {
            assert!(part.content.is_empty(), "{line} is in the layout and not declared");
            let gap = if line.starts_with("  ") { "" } else { "\n" };
            part.introduction += &format!("{gap}{line}\n");
        }
    }
    let missing = arranger.items.keys().find(|name| !arranger.placed.contains_key(*name));
    assert!(missing.is_none(), "{missing:?} is declared and not in the layout");
    parts
}

const MADE: &str = "// Generated by cbindgen from src/capi; do not edit.\n";
const SYSTEM: &str = "#include <stddef.h>\n#include <stdint.h>\n";
const OPEN: &str = "\n#ifdef __cplusplus\nextern \"C\" {\n#endif\n";
const CLOSE: &str = "\n#ifdef __cplusplus\n}\n#endif\n\n#endif\n";
/// Macros of base.h that shorten the other headers.
const LINKAGE: &str = "\n#ifdef __cplusplus\n#define SINEW_BEGIN extern \"C\" {\n#define SINEW_END }\n#else\n\
    #define SINEW_BEGIN\n#define SINEW_END\n#endif\n";

/// Returns the text of a header after its introduction.
fn header_start(guard: &str) -> String {
    format!("\n#ifndef {guard} // generated by cbindgen from src/capi: do not edit\n#define {guard}\n\n")
}

/// Returns all headers generated from the declarations of cbindgen.
pub fn arrange(declared: &str) -> Vec<Header> {
    let parts = parts(items(declared));
    let mut headers = Vec::new();
    let mut overview = prose(OVERVIEW) + &header_start("SINEW_H");
    let mut all = "// sinew: all headers of include/sinew/ in one, for LuaJIT, cffi and other tools.\n".to_owned();
    all += &format!("{MADE}\n#ifndef SINEW_H\n#define SINEW_H\n");
    for part in &parts {
        all += &format!("#define {}\n", guard(&part.name));
    }
    all += &format!("\n{SYSTEM}{OPEN}");
    for part in &parts {
        overview += &format!("#include \"sinew/{}.h\"\n", part.name);
        let guard = guard(&part.name);
        let mut text = prose(&part.introduction) + &header_start(&guard);
        if part.includes.is_empty() {
            text += &format!("{SYSTEM}{LINKAGE}");
        }
        for header in &part.includes {
            text += &format!("#include \"{header}.h\"\n");
        }
        text += &format!("\nSINEW_BEGIN\n{}\nSINEW_END\n\n#endif\n", part.content);
        headers.push(Header {
            path: format!("sinew/{}.h", part.name),
            text,
        });
        all += &format!("\n{}{}", prose(&part.introduction), part.content);
    }
    overview += "#include \"sinew/helpers.h\"\n\n";
    overview += "#ifdef SINEW_COMPAT_0_1 // names of version 0.1\n#include \"sinew/compat_0_1.h\"\n#endif\n\n#endif\n";
    all += CLOSE;
    for (path, text) in [("sinew.h", overview), ("sinew/sinew_all.h", all)] {
        headers.push(Header {
            path: path.to_owned(),
            text,
        });
    }
    headers
}
