//! A description of the machine.

use std::fmt::Write;

/// Processor, caches, instruction sets and load, as a Markdown list.
pub fn description() -> String {
    let mut text = String::new();
    let processor = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = processor
        .lines()
        .find_map(|line| line.strip_prefix("model name")?.split_once(": "));
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let _ = writeln!(
        text,
        "- Machine: {}, {cores} cores for us; {}.",
        name.map_or("unknown", |(_, name)| name),
        caches().unwrap_or_else(|| "caches unknown".into())
    );
    let instructions: Vec<&str> = [
        ("AVX-512", "avx512f"),
        ("AVX2", "avx2"),
        ("FMA", "fma"),
        ("NEON", "asimd"),
    ]
    .into_iter()
    .filter(|(_, flag)| processor.split_whitespace().any(|word| word == *flag))
    .map(|(name, _)| name)
    .collect();
    let _ = writeln!(text, "- Instructions: {}.", instructions.join(", "));
    if let Ok(pages) = std::fs::read_to_string("/sys/kernel/mm/transparent_hugepage/enabled") {
        let _ = writeln!(text, "- Huge pages: `{}`.", pages.trim());
    }
    if let Ok(load) = std::fs::read_to_string("/proc/loadavg") {
        let load = load.split(' ').next().unwrap_or_default();
        let _ = writeln!(text, "- Load when this began: {load}.");
    }
    text
}

/// The caches of the first core.
fn caches() -> Option<String> {
    let mut caches = Vec::new();
    for entry in std::fs::read_dir("/sys/devices/system/cpu/cpu0/cache").ok()? {
        let path = entry.ok()?.path();
        let read = |name: &str| std::fs::read_to_string(path.join(name)).map(|text| text.trim().to_owned());
        if let (Ok(level), Ok(kind), Ok(size)) = (read("level"), read("type"), read("size"))
            && kind != "Instruction"
        {
            caches.push(format!("L{level} {size}"));
        }
    }
    caches.sort();
    (!caches.is_empty()).then(|| caches.join(", "))
}
