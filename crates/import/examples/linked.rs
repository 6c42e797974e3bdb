//! Links every reader without using a file system: what `tests/bench/wasm_sizes.py` measures.

use drivescope_import::{MemorySource, Opening, open_log};

fn main() {
    let bytes = std::hint::black_box(Vec::new());
    let source = MemorySource::new(std::hint::black_box("log"), bytes);
    let opened = Opening::new(vec![Box::new(source)]).and_then(|mut opening| {
        while opening.step()? {}
        open_log(opening.finish()?, None)
    });
    std::hint::black_box(opened).map_or_else(|e| println!("{e}"), |(drive, _)| println!("{}", drive.name));
}
