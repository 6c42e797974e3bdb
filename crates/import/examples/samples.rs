//! Writes a small log of every format that is read, with what belongs to it: `samples FOLDER`. The page's tests open them.

#![allow(clippy::unwrap_used)]

#[path = "../tests/samples/mod.rs"]
mod samples;

fn main() {
    let folder = std::path::PathBuf::from(std::env::args().nth(1).expect("samples FOLDER"));
    for sample in samples::all() {
        for (name, bytes) in sample.files {
            let file = folder.join(sample.name.replace(' ', "_")).join(name);
            std::fs::create_dir_all(file.parent().unwrap()).unwrap();
            std::fs::write(file, bytes).unwrap();
        }
    }
}
