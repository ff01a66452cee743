//! The header and the library in C and C++ programs. Every program of `tests/c` is compiled as both, linked to the
//! shared and to the static library, and run; the examples are compiled. Then the programs run under sanitizers and
//! valgrind.
#![cfg(target_os = "linux")]

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;
use std::thread;

use crate::support::{Library, failure, installed, root, skip, succeed};

const WARNINGS: [&str; 4] = ["-Wall", "-Wextra", "-Wpedantic", "-Werror"];

/// An installed compiler for one language.
struct Compiler {
    name: &'static str,
    /// The language as `-x` names it.
    language: &'static str,
}

const ALL_COMPILERS: [Compiler; 4] = [
    Compiler {
        name: "gcc",
        language: "c",
    },
    Compiler {
        name: "g++",
        language: "c++",
    },
    Compiler {
        name: "clang",
        language: "c",
    },
    Compiler {
        name: "clang++",
        language: "c++",
    },
];

impl Compiler {
    fn installed() -> impl Iterator<Item = &'static Compiler> {
        ALL_COMPILERS.iter().filter(|compiler| {
            let is_installed = installed(compiler.name);
            if !is_installed {
                skip(&format!("{}, which is not installed", compiler.name));
            }
            is_installed
        })
    }

    /// Returns the first installed compiler of each language, or the others.
    fn first_of_each_language(is_first: bool) -> impl Iterator<Item = &'static Compiler> {
        let mut languages = BTreeSet::new();
        Self::installed().filter(move |compiler| languages.insert(compiler.language) == is_first)
    }

    /// Returns all standards that the header supports.
    fn standards(&self) -> &'static [&'static str] {
        match self.language {
            "c" => &["c99", "c11", "c17", "c2x"],
            _ => &["c++11", "c++14", "c++17", "c++20", "c++2b"],
        }
    }

    /// Returns the standard of the test programs.
    fn standard(&self) -> &'static str {
        match self.language {
            "c" => "c99",
            _ => "c++17",
        }
    }

    /// Compiles and links a program; returns its path.
    fn build(&self, source: &Path, build: &Build) -> PathBuf {
        let program = Path::new(env!("CARGO_TARGET_TMPDIR"))
            .join(build.name)
            .join(self.name)
            .join(source.strip_prefix(root()).expect("a source of the crate"))
            .with_extension("");
        std::fs::create_dir_all(program.parent().expect("a folder")).expect("the target directory can be written");
        let mut command = Command::new(self.name);
        command
            .arg(format!("-std={}", self.standard()))
            .args(WARNINGS)
            .args(["-O1", "-g", "-pthread"])
            .args(build.options)
            .arg(format!("-DEXPECTED_VERSION={}", version()))
            .arg("-I")
            .arg(root().join("include"))
            .args(["-x", self.language])
            .arg(source)
            .args(["-x", "none", "-o"])
            .arg(&program);
        let library = (build.library)();
        match build.link {
            Link::Shared => command
                .arg(library.shared())
                .arg(format!("-Wl,-rpath,{}", library.folder.display())),
            Link::Static => command.arg(library.archive()).args(&library.native_libraries),
        };
        succeed(command.arg("-lm"));
        program
    }
}

enum Link {
    Shared,
    Static,
}

/// A configuration of the programs, in a folder of its own: the tests run in parallel.
struct Build {
    name: &'static str,
    library: fn() -> &'static Library,
    link: Link,
    options: &'static [&'static str],
}

const SHARED: Build = Build {
    name: "shared",
    library: Library::get,
    link: Link::Shared,
    options: &[],
};

const STATIC: Build = Build {
    name: "static",
    library: Library::release,
    link: Link::Static,
    options: &[],
};

const SANITIZED: Build = Build {
    name: "sanitized",
    library: Library::release,
    link: Link::Shared,
    options: &["-fsanitize=address,undefined", "-fno-sanitize-recover=all"],
};

const ALLOCATOR: Build = Build {
    name: "allocator",
    library: Library::with_allocator,
    link: Link::Shared,
    options: &[],
};

const CHECKED: Build = Build {
    name: "valgrind",
    library: Library::release,
    link: Link::Shared,
    options: &[],
};

/// Returns the version of the crate as `sinew_version` does.
fn version() -> u32 {
    let part = |text: &str| text.parse::<u32>().expect("a number");
    part(env!("CARGO_PKG_VERSION_MAJOR")) << 16
        | part(env!("CARGO_PKG_VERSION_MINOR")) << 8
        | part(env!("CARGO_PKG_VERSION_PATCH"))
}

/// Returns the C programs of a folder, ordered by name.
fn sources(folder: &str) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(root().join(folder)) else {
        return Vec::new();
    };
    let mut sources: Vec<PathBuf> = entries
        .map(|entry| entry.expect("a folder can be read").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "c"))
        .collect();
    sources.sort();
    sources
}

/// Runs all programs, several in parallel, and reports every failure. Each finds its library by its own path: the
/// loader path of cargo contains older builds.
fn run_all(programs: impl Iterator<Item = Command> + Send) {
    let programs = Mutex::new(programs);
    let next = || programs.lock().expect("no program panicked").next();
    let run = || {
        let mut failures = Vec::new();
        while let Some(mut program) = next() {
            program
                .env_remove("LD_LIBRARY_PATH")
                .env("TMPDIR", env!("CARGO_TARGET_TMPDIR"))
                .current_dir(env!("CARGO_TARGET_TMPDIR"));
            failures.extend(failure(&mut program));
        }
        failures
    };
    let failures: Vec<String> = thread::scope(|scope| {
        let count = thread::available_parallelism().map_or(1, usize::from);
        let running: Vec<_> = (0..count).map(|_| scope.spawn(run)).collect();
        let ended = running
            .into_iter()
            .map(|thread| thread.join().expect("a program that builds"));
        ended.flatten().collect()
    });
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

fn every_program_runs<'a>(compilers: impl Iterator<Item = &'a Compiler> + Send, build: &Build) {
    let programs = sources("tests/c");
    assert!(!programs.is_empty(), "there are programs in tests/c");
    run_all(compilers.flat_map(|compiler| {
        let built = programs.iter().map(move |source| compiler.build(source, build));
        built.map(Command::new)
    }));
}

#[test]
fn programs_run_with_the_shared_library() {
    every_program_runs(Compiler::first_of_each_language(true), &SHARED);
}

#[test]
#[ignore = "long"]
fn programs_of_the_other_compilers_run_with_the_shared_library() {
    every_program_runs(Compiler::first_of_each_language(false), &SHARED);
}

#[test]
#[ignore = "long"]
fn programs_run_with_the_static_library() {
    // Compilation does not depend on the library: one compiler per language links it.
    every_program_runs(Compiler::first_of_each_language(true), &STATIC);
}

/// The program replaces glibc's allocator.
#[test]
#[cfg(target_env = "gnu")]
fn the_first_failed_allocation_returns_an_error() {
    if let Some(compiler) = Compiler::installed().find(|compiler| compiler.language == "c") {
        let program = compiler.build(&root().join("tests/out_of_memory.c"), &SHARED);
        run_all([Command::new(program)].into_iter());
    }
}

/// The program counts the requests to its own allocator.
#[test]
#[ignore = "long"]
fn a_program_brings_its_own_allocator() {
    let Some(compiler) = Compiler::installed().find(|compiler| compiler.language == "c") else {
        return;
    };
    let output = succeed(&mut Command::new(
        compiler.build(&root().join("tests/c/allocator.c"), &ALLOCATOR),
    ));
    let printed = String::from_utf8_lossy(&output.stdout);
    assert!(printed.contains("all memory is the program's"), "{printed}");
}

#[test]
fn the_examples_compile_as_c_and_as_cxx() {
    the_examples_compile(Compiler::first_of_each_language(true));
}

#[test]
#[ignore = "long"]
fn the_examples_compile_with_the_other_compilers() {
    the_examples_compile(Compiler::first_of_each_language(false));
}

fn the_examples_compile(compilers: impl Iterator<Item = &'static Compiler>) {
    for compiler in compilers {
        for folder in ["c_examples", "c_examples/lessons"] {
            for source in sources(folder) {
                compiler.build(&source, &SHARED);
            }
        }
    }
}

/// Lessons are short, are listed in the guide, and print what the comment at their top states.
#[test]
fn lessons_print_the_output_that_they_state() {
    let Some(compiler) = Compiler::installed().find(|compiler| compiler.language == "c") else {
        return;
    };
    let index = std::fs::read_to_string(root().join("docs/guide/examples.md")).expect("the list of examples");
    let lessons = sources("c_examples/lessons");
    assert!(lessons.len() >= 18, "{} lessons", lessons.len());
    let mut wrong = Vec::new();
    for lesson in lessons {
        let name = lesson.file_name().expect("a file").to_string_lossy();
        let text = std::fs::read_to_string(&lesson).expect("a lesson");
        let (comment, _) = text.split_once("\n */\n").expect("a comment at the top");
        let (_, stated) = comment.split_once(" * Output:\n").expect("a stated output");
        let stated: Vec<&str> = stated.lines().map(|line| line.trim_start_matches(" *   ")).collect();
        let output = succeed(&mut Command::new(compiler.build(&lesson, &SHARED)));
        let printed = String::from_utf8_lossy(&output.stdout);
        if printed.lines().collect::<Vec<_>>() != stated {
            wrong.push(format!("{name} prints:\n{printed}"));
        }
        if text.lines().count() > 80 {
            wrong.push(format!("{name} has more than 80 lines"));
        }
        if !index.contains(&format!("`{name}`")) {
            wrong.push(format!("docs/guide/examples.md lacks {name}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Returns the C headers below `include/`.
fn headers() -> Vec<String> {
    let entries = std::fs::read_dir(root().join("include/sinew")).expect("include/sinew");
    let names = entries.map(|entry| entry.expect("a file").file_name());
    let mut headers: Vec<String> = names.map(|name| format!("sinew/{}", name.to_string_lossy())).collect();
    headers.push("sinew.h".to_owned());
    headers
}

#[test]
fn each_header_compiles_alone_in_every_standard() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("alone");
    std::fs::create_dir_all(&folder).expect("a folder can be made");
    let headers = headers();
    assert!(headers.len() > 10, "{headers:?}");
    let alone: Vec<PathBuf> = headers
        .iter()
        .map(|header| {
            let file = folder.join(header.replace('/', "_")).with_extension("c");
            let text = format!("#include \"{header}\"\n#include \"{header}\"\n");
            std::fs::write(&file, text).expect("a file can be written");
            file
        })
        .collect();
    for compiler in Compiler::installed() {
        for standard in compiler.standards() {
            succeed(
                Command::new(compiler.name)
                    .arg(format!("-std={standard}"))
                    .args(WARNINGS)
                    .arg("-fsyntax-only")
                    .arg("-I")
                    .arg(root().join("include"))
                    .args(["-x", compiler.language])
                    .args(&alone),
            );
        }
    }
}

/// Compiles this text as a separate program; `None` if that fails.
fn compile(compiler: &Compiler, build: &Build, name: &str, text: &str) -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(build.name);
    std::fs::create_dir_all(&folder).expect("a folder can be made");
    let source = folder.join(name).with_extension("c");
    let program = source.with_extension("out");
    std::fs::write(&source, text).expect("a file can be written");
    let done = Command::new(compiler.name)
        .args(build.options)
        .arg("-g")
        .arg(&source)
        .arg("-o")
        .arg(&program)
        .output();
    done.is_ok_and(|output| output.status.success()).then_some(program)
}

/// True if a program exits successfully.
fn succeeds(command: &mut Command) -> bool {
    command.output().is_ok_and(|output| output.status.success())
}

/// Writes out of bounds, and exits successfully without a sanitizer.
const BEYOND: &str = "#include <stdlib.h>
int main(int count, char **words) {
    char *two = (char *)malloc(2);
    (void)words;
    two[count + 1] = 1;
    count = two[count + 1] - 1;
    free(two);
    return count;
}
";

/// Overflows an addition.
const OVERFLOW: &str = "int main(int count, char **words) {
    int most = 2147483647;
    (void)words;
    return (most + count) & 1;
}
";

/// Leaks an allocation.
const LEAK: &str = "#include <stdlib.h>
int main(int count, char **words) {
    char *lost = (char *)malloc((size_t)count * 100);
    (void)words;
    lost[0] = 0;
    count = lost[0];
    lost = NULL;
    return count;
}
";

/// True if the compiler's address and undefined-behavior sanitizers are installed and work.
fn sanitizers_work(compiler: &Compiler) -> bool {
    compile(compiler, &SANITIZED, "nothing", "int main(void) { return 0; }\n")
        .is_some_and(|program| succeeds(&mut Command::new(program)))
}

#[test]
#[ignore = "long"]
fn sanitizers_find_nothing() {
    let Some(compiler) = Compiler::installed().find(|compiler| sanitizers_work(compiler)) else {
        return skip("the sanitizers, which no compiler here has");
    };
    for (name, fault) in [("beyond", BEYOND), ("overflow", OVERFLOW)] {
        let planted = compile(compiler, &SANITIZED, name, fault).expect("a program");
        assert!(!succeeds(&mut Command::new(planted)), "{name} is not found");
    }
    let programs = sources("tests/c").into_iter();
    run_all(programs.map(|source| Command::new(compiler.build(&source, &SANITIZED))));
}

#[test]
#[ignore = "long"]
fn valgrind_finds_nothing() {
    if !installed("valgrind") {
        return skip("valgrind, which is not installed");
    }
    let Some(compiler) = Compiler::installed().next() else {
        return;
    };
    let checked = |program: PathBuf| {
        let mut valgrind = Command::new("valgrind");
        valgrind
            .args(["--quiet", "--leak-check=full", "--error-exitcode=9"])
            .arg(program);
        valgrind
    };
    for (name, fault) in [("beyond", BEYOND), ("leak", LEAK)] {
        let planted = compile(compiler, &CHECKED, name, fault).expect("a program");
        assert!(succeeds(&mut Command::new(&planted)), "{name} is no good program");
        assert!(!succeeds(&mut checked(planted)), "{name} is not found");
    }
    let programs = sources("tests/c").into_iter();
    run_all(programs.map(|source| checked(compiler.build(&source, &CHECKED))));
}
