//! Generates declarations for Python (cffi) and C# from the single header with all declarations.

use std::collections::BTreeMap;
use std::fmt::Write;

/// Returns the declarations of a header without comments, preprocessor lines and C++ parts.
fn code(header: &str) -> String {
    let lines = header
        .lines()
        .map(|line| line.split("//").next().unwrap_or_default().trim_end());
    let kept = lines.filter(|line| !line.starts_with('#') && !line.is_empty() && *line != "extern \"C\" {");
    // The last brace closes an extern block of C++.
    let mut kept: Vec<&str> = kept.collect();
    let closing = kept.iter().rposition(|line| *line == "}");
    closing.map(|index| kept.remove(index));
    kept.join("\n")
}

/// Returns the constants that are no enumerators, as numbers.
fn constants(header: &str) -> Vec<(&str, u64)> {
    let defines = header.lines().filter_map(|line| line.strip_prefix("#define "));
    let words = defines.filter_map(|line| line.split("//").next()?.trim().split_once(' '));
    let number = |value: &str| match value {
        "UINT32_MAX" => Some(u64::from(u32::MAX)),
        value => value.parse().ok(),
    };
    words
        .filter_map(|(name, value)| Some((name, number(value.trim())?)))
        .collect()
}

/// Returns the input of cffi's `ffi.cdef`.
pub fn cffi(header: &str) -> String {
    let mut text = String::from("// Generated from include/sinew; do not edit. For ffi.cdef of cffi.\n");
    for (name, value) in constants(header) {
        writeln!(text, "#define {name} {value}").expect("a string");
    }
    writeln!(text, "{}", code(header)).expect("a string");
    text
}

/// Returns the C statements, each on one line.
fn statements(code: &str) -> Vec<String> {
    let (mut all, mut depth, mut start) = (Vec::new(), 0, 0);
    for (index, letter) in code.char_indices() {
        match letter {
            '{' => depth += 1,
            '}' => depth -= 1,
            ';' if depth == 0 => {
                all.push(code[start..index].split_whitespace().collect::<Vec<_>>().join(" "));
                start = index + 1;
            }
            _ => {}
        }
    }
    all
}

const KEYWORDS: [&str; 8] = ["out", "in", "ref", "params", "base", "object", "lock", "checked"];

fn name(of: &str) -> String {
    if KEYWORDS.contains(&of) {
        format!("@{of}")
    } else {
        of.to_owned()
    }
}

/// Returns a declared type in C#, and the name after it. `opaque` types are addresses in C#: callbacks, and handle
/// types, whose one star is part of the type.
fn typed<'a>(declared: &'a str, opaque: &BTreeMap<String, usize>) -> (String, &'a str) {
    let end = declared.rfind([' ', '*']).map_or(0, |index| index + 1);
    let (kind, name) = declared.split_at(end);
    let stars = kind.matches('*').count();
    let words = kind.replace(['*'], " ");
    let base = words
        .split_whitespace()
        .find(|word| *word != "const")
        .unwrap_or_default();
    let (base, stars) = match base {
        "size_t" => ("UIntPtr", stars),
        "uint32_t" => ("uint", stars),
        "int32_t" | "sinew_status" => ("int", stars),
        "uint64_t" => ("ulong", stars),
        "uint8_t" | "char" => ("byte", stars),
        base => match opaque.get(base) {
            Some(own) => ("IntPtr", stars.saturating_sub(*own)),
            None => (base, stars),
        },
    };
    (format!("{base}{}", "*".repeat(stars)), name)
}

/// Returns a class with every function, constant and struct.
pub fn csharp(header: &str) -> String {
    let mut opaque = BTreeMap::new();
    let statements = statements(&code(header));
    for statement in &statements {
        if let Some(rest) = statement
            .strip_prefix("typedef struct ")
            .filter(|rest| !rest.contains('{'))
        {
            opaque.insert(rest.split(' ').next().unwrap_or_default().to_owned(), 1);
        } else if let Some((_, rest)) = statement.split_once("(*").filter(|_| statement.starts_with("typedef")) {
            opaque.insert(rest.split(')').next().unwrap_or_default().to_owned(), 0);
        }
    }
    let mut text = String::from(
        "// Generated from include/sinew; do not edit. Names, units and rules are those of the C headers.\n\
         // Compile with -unsafe. sinew_status is int, size_t UIntPtr, an opaque handle or callback IntPtr.\n\
         using System;\nusing System.Runtime.InteropServices;\n\npublic static unsafe class Sinew\n{\n    \
         const string Library = \"sinew\";\n",
    );
    for (constant, value) in constants(header) {
        writeln!(text, "    public const uint {constant} = {value};").expect("a string");
    }
    for statement in &statements {
        let line = if let Some(rest) = statement.strip_prefix("typedef enum ") {
            let (kind, body) = rest.split_once(" {").expect("an enum");
            format!(
                "    public enum {kind} {{{}}}\n",
                body.split('}').next().unwrap_or_default()
            )
        } else if let Some(rest) = statement
            .strip_prefix("typedef struct ")
            .filter(|rest| rest.contains('{'))
        {
            structure(rest, &opaque)
        } else if statement.starts_with("typedef") {
            continue;
        } else {
            function(statement, &opaque)
        };
        write!(text, "\n{line}").expect("a string");
    }
    text + "}\n"
}

fn structure(rest: &str, opaque: &BTreeMap<String, usize>) -> String {
    let (kind, body) = rest.split_once(" {").expect("a struct");
    let mut text = format!("    [StructLayout(LayoutKind.Sequential)]\n    public struct {kind}\n    {{\n");
    for field in body.split('}').next().unwrap_or_default().split(';').map(str::trim) {
        if field.is_empty() {
            continue;
        }
        let (declared, count) = match field.split_once('[') {
            Some((declared, count)) => (declared, Some(count.trim_end_matches(']'))),
            None => (field, None),
        };
        let (kind, field) = typed(declared, opaque);
        let line = match count {
            None => format!("public {kind} {};", name(field)),
            Some(count) if kind.starts_with("sinew_") => {
                let count: u32 = count.parse().expect("a length");
                let fields: Vec<String> = (0..count).map(|index| format!("{field}_{index}")).collect();
                format!("public {kind} {};", fields.join(", "))
            }
            Some(count) => format!("public fixed {kind} {}[{count}];", name(field)),
        };
        writeln!(text, "        {line}").expect("a string");
    }
    text + "    }\n"
}

fn function(statement: &str, opaque: &BTreeMap<String, usize>) -> String {
    let (head, arguments) = statement.split_once('(').expect("a function");
    let (kind, function) = typed(head, opaque);
    let arguments = arguments.trim_end_matches(')').split(',').map(str::trim);
    let arguments: Vec<String> = arguments
        .filter(|argument| *argument != "void")
        .map(|argument| {
            let (kind, argument) = typed(argument, opaque);
            format!("{kind} {}", name(argument))
        })
        .collect();
    format!(
        "    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]\n    public static extern {kind} {function}({});\n",
        arguments.join(", ")
    )
}
