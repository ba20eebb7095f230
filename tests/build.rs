//! Tells the tests of this package and of `mrt-editor` which folders of ground truth exist: `cfg(has_oracle)` for
//! `shared/oracle`, and so on. The test runner then reports a test that needs an absent folder as ignored.
//!
//! Cargo runs this again when `MRT_SHARED` changes, or a folder that was found. It cannot watch for a folder that is
//! still absent; `tests/run` sets `MRT_SHARED` where it finds one.

#[path = "../mrt-core/src/reference/oracle_file/folder.rs"]
mod folder;

const FOLDERS: [&str; 5] = [
    "oracle",
    "oracle-scenes",
    "oracle-siblings",
    "cases",
    "data",
];

fn main() {
    println!("cargo::rerun-if-changed=../tests/build.rs");
    println!("cargo::rerun-if-changed=../mrt-core/src/reference/oracle_file/folder.rs");
    println!("cargo::rerun-if-env-changed=MRT_SHARED");
    println!("cargo::rerun-if-env-changed=CI");
    for name in FOLDERS {
        let cfg = format!("has_{}", name.replace('-', "_"));
        println!("cargo::rustc-check-cfg=cfg({cfg})");
        let found = folder::ground_truth_folder(name);
        if let Some(folder) = &found {
            println!("cargo::rerun-if-changed={}", folder.display());
        }
        // Where `CI` is set, a test without its folder must fail and not be ignored.
        if found.is_some() || std::env::var_os("CI").is_some() {
            println!("cargo::rustc-cfg={cfg}");
        }
    }
}
