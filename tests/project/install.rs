//! The results of `make install`: C and C++ programs are built with their headers against the installed tree only, with
//! pkg-config and with CMake, shared and static, also after the tree has been moved. `uninstall` removes all of it.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::support::{Library, installed, root, skip, succeed};

const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Returns the versions that name the ABI.
fn abi() -> &'static str {
    VERSION.rsplit_once('.').unwrap().0
}

/// Creates an empty folder for one test.
fn scratch(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("install").join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

fn make(target: &str, settings: &[String]) {
    // Built once, by the first test: then make finds it there.
    Library::release();
    let target_folder = Path::new(env!("CARGO_TARGET_TMPDIR")).parent().unwrap();
    succeed(
        Command::new("make")
            .arg("-C")
            .arg(root().join("c_examples"))
            .arg(target)
            .args(settings)
            .env("CARGO_TARGET_DIR", target_folder)
            .env_remove("MAKEFLAGS"),
    );
}

/// Installs, then moves the tree to its final folder: the package must not contain its path. Leftovers have another
/// name.
fn moved_tree(name: &str, libdir: &str) -> PathBuf {
    let folder = scratch(name);
    make(
        "install",
        &[
            format!("DESTDIR={}", folder.join("stage").display()),
            "PREFIX=/opt/sinew".into(),
            format!("LIBDIR=/opt/sinew/{libdir}"),
        ],
    );
    let tree = folder.join("tree");
    std::fs::rename(folder.join("stage/opt/sinew"), &tree).unwrap();
    tree
}

/// Checks that a program runs, prints the quickstart's output, and links the shared library if `shared`.
fn check_program(program: &Path, shared: bool) {
    let output = succeed(Command::new(program).env_remove("LD_LIBRARY_PATH"));
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(said.contains("force on the ball"), "{said}");
    let output = succeed(Command::new("readelf").arg("-d").arg(program));
    let needed = String::from_utf8(output.stdout).unwrap();
    let name = format!("libsinew.so.{}", abi());
    assert_eq!(needed.contains(&name), shared, "{needed}");
}

#[test]
#[ignore = "long"]
fn pkg_config_builds_c_and_cxx_shared_and_static() {
    if !installed("pkg-config") {
        return skip("programs built with pkg-config, which is not installed");
    }
    // Nested, as on Debian.
    let tree = moved_tree("pkg_config", "lib/of/this/machine");
    let lib = tree.join("lib/of/this/machine");
    let ask = |arguments: &[&str]| {
        let output = succeed(
            Command::new("pkg-config")
                .args(arguments)
                .env("PKG_CONFIG_LIBDIR", lib.join("pkgconfig"))
                .env_remove("PKG_CONFIG_PATH"),
        );
        let words = String::from_utf8(output.stdout).unwrap();
        words.split_whitespace().map(str::to_owned).collect::<Vec<_>>()
    };
    assert_eq!(ask(&["--modversion", "sinew"]), [VERSION]);
    for (compiler, language) in [("cc", "c"), ("c++", "cpp")] {
        if !installed(compiler) {
            skip(&format!("{compiler}, which is not installed"));
            continue;
        }
        for (package, shared) in [("sinew", true), ("sinew-static", false)] {
            let program = tree.join(format!("{package}-{compiler}"));
            succeed(
                Command::new(compiler)
                    .arg(root().join("c_examples/quickstart").with_extension(language))
                    .args((language == "cpp").then_some("-std=c++17"))
                    .arg("-o")
                    .arg(&program)
                    .args(ask(&["--cflags", "--libs", package]))
                    .arg(format!("-Wl,-rpath,{}", lib.display())),
            );
            check_program(&program, shared);
        }
    }
    // All libraries that the compiler reports for the static library are listed.
    let private = ask(&["--static", "--libs", "sinew"]);
    for library in &Library::release().native_libraries {
        assert!(
            private.contains(library),
            "{library}, which rustc names, in {private:?}"
        );
    }
}

const PROJECT: &str = r#"
cmake_minimum_required(VERSION 3.16)
project(user C CXX)
set(CMAKE_CXX_STANDARD 17)
find_package(sinew @VERSION@ REQUIRED)
foreach(version 0.0 @NEXT@ 99)
  find_package(sinew ${version} QUIET)
  if(sinew_FOUND)
    message(FATAL_ERROR "sinew ${version} is not what is installed")
  endif()
endforeach()
find_package(sinew @ABI@ REQUIRED)
find_package(sinew REQUIRED)
configure_file(@SOURCE@.c user.c COPYONLY)
configure_file(@SOURCE@.cpp user.cpp COPYONLY)
foreach(language c cpp)
  foreach(library sinew static)
    add_executable(${language}-${library} ${CMAKE_BINARY_DIR}/user.${language})
    target_link_libraries(${language}-${library} PRIVATE sinew::${library})
  endforeach()
endforeach()
"#;

#[test]
#[ignore = "long"]
fn cmake_builds_c_and_cxx_shared_and_static() {
    if !installed("cmake") {
        return skip("programs built with CMake, which is not installed");
    }
    if !installed("c++") {
        return skip("programs built with CMake: no C++ compiler");
    }
    let tree = moved_tree("cmake", "lib");
    let project = tree.join("user");
    std::fs::create_dir(&project).unwrap();
    let next = format!("{VERSION}.1");
    let source = root().join("c_examples/quickstart");
    let text = PROJECT
        .replace("@VERSION@", VERSION)
        .replace("@NEXT@", &next)
        .replace("@ABI@", abi())
        .replace("@SOURCE@", source.to_str().unwrap());
    std::fs::write(project.join("CMakeLists.txt"), text).unwrap();
    let build = project.join("build");
    succeed(
        Command::new("cmake")
            .arg("-S")
            .arg(&project)
            .arg("-B")
            .arg(&build)
            .arg(format!("-DCMAKE_PREFIX_PATH={}", tree.display())),
    );
    succeed(Command::new("cmake").arg("--build").arg(&build));
    for language in ["c", "cpp"] {
        check_program(&build.join(format!("{language}-sinew")), true);
        check_program(&build.join(format!("{language}-static")), false);
    }
    // A missing part of the package is reported when it is searched for, not by the linker.
    std::fs::remove_file(tree.join("lib/libsinew.a")).unwrap();
    let output = Command::new("cmake").arg(&build).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success() && said.contains("libsinew.a"), "{said}");
}

/// Returns all files and links below a folder.
fn files(folder: &Path) -> BTreeSet<PathBuf> {
    let mut found = BTreeSet::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() && !path.is_symlink() {
            found.extend(files(&path));
        } else {
            found.insert(path);
        }
    }
    found
}

#[test]
#[ignore = "long"]
fn uninstall_removes_exactly_the_installed_files() {
    // A name with a space, which unquoted shell code would split.
    let prefix = scratch("un install");
    let settings = [format!("PREFIX={}", prefix.display())];
    let others = [prefix.join("lib/libother.so"), prefix.join("include/other.h")];
    for other in &others {
        std::fs::create_dir_all(other.parent().unwrap()).unwrap();
        std::fs::write(other, "of somebody else").unwrap();
    }
    make("install", &settings);
    make("install", &settings);
    let of_prefix = |file: PathBuf| file.strip_prefix(prefix.join("include")).map(Path::to_owned).ok();
    let brought: BTreeSet<PathBuf> = files(&prefix).into_iter().filter_map(of_prefix).collect();
    for header in files(&root().join("include")) {
        let name = header.strip_prefix(root().join("include")).unwrap();
        assert!(brought.contains(name), "{} is not installed", name.display());
    }
    let library = prefix.join("lib").join(format!("libsinew.so.{VERSION}"));
    assert!(library.is_file() && !library.is_symlink());
    for name in ["libsinew.so".to_owned(), format!("libsinew.so.{}", abi())] {
        let link = prefix.join("lib").join(name);
        assert!(link.is_symlink() && link.canonicalize().unwrap() == library.canonicalize().unwrap());
    }
    let text = |path: &Path| std::fs::read_to_string(path).unwrap();
    for path in files(&prefix) {
        let plain = path
            .extension()
            .is_some_and(|extension| extension == "pc" || extension == "cmake");
        if plain {
            let (text, prefix_text) = (text(&path), prefix.to_str().unwrap());
            let unfilled = text.split('@').count() > 2;
            assert!(!text.contains(prefix_text) && !unfilled, "{}:\n{text}", path.display());
        }
    }
    make("uninstall", &settings);
    assert_eq!(files(&prefix), BTreeSet::from(others));
    assert!(!prefix.join("include/sinew").exists());
}

#[test]
fn the_makefile_and_the_manifest_agree_on_the_library_name() {
    let manifest = std::fs::read_to_string(root().join("Cargo.toml")).unwrap();
    // cargo-c uses as many components of the version as build.rs.
    let components = abi().split('.').count();
    assert!(manifest.contains(&format!("version_suffix_components = {components}")));
    let headers = std::fs::read_dir(root().join("include")).unwrap();
    for header in headers {
        let header = header.unwrap();
        let name = header.file_name().into_string().unwrap();
        let asset = match header.path().is_dir() {
            true => format!("{{ from = \"include/{name}/*.h\", to = \"{name}\" }}"),
            false => format!("{{ from = \"include/{name}\", to = \"\" }}"),
        };
        assert!(manifest.contains(&asset), "cargo capi install brings {name}");
    }
    let output = succeed(Command::new("readelf").arg("-d").arg(Library::get().shared()));
    let soname = format!("soname: [libsinew.so.{}]", abi());
    assert!(String::from_utf8(output.stdout).unwrap().contains(&soname), "{soname}");
}
