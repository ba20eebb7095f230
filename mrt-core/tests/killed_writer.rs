//! A program that is killed while it writes leaves the old file or the new one.

use mrt_core::container::{remove_abandoned_parts, write_file_atomically};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, SystemTime};

/// Names the file to the child.
const TARGET: &str = "MRT_KILLED_WRITER_TARGET";

/// Bytes of the file: enough that most of the time goes into writing them.
const LENGTH: usize = 4 << 20;

/// Children that are killed, each at another moment.
const CHILDREN: u64 = 40;

#[test]
#[ignore = "runs as a child of the other test"]
fn child() {
    let target = PathBuf::from(std::env::var_os(TARGET).expect("set by the parent"));
    for content in (0..=u8::MAX).cycle() {
        write_file_atomically(&target, &vec![content; LENGTH]).expect("writable");
    }
}

#[test]
fn a_killed_program_leaves_a_whole_file() {
    let folder = tempfile::tempdir().expect("there is room for temporary files");
    let target = folder.path().join("file");
    fs::write(&target, vec![0; LENGTH]).expect("writable");
    let mut changes = 0;
    let mut before = 0;
    for moment in 0..CHILDREN {
        let mut child = Command::new(std::env::current_exe().expect("this program"))
            .args(["--exact", "child", "--include-ignored"])
            .env(TARGET, &target)
            .stdout(Stdio::null())
            .spawn()
            .expect("starts");
        // The fractional parts of multiples of the golden ratio are spread evenly.
        let fraction = (moment as f64 * 0.618_034).fract();
        std::thread::sleep(Duration::from_secs_f64(0.01 + 0.05 * fraction));
        child.kill().expect("it runs");
        child.wait().expect("it ends");
        let found = fs::read(&target).expect("there");
        assert_eq!(found.len(), LENGTH);
        assert!(found.iter().all(|&byte| byte == found[0]), "a mixture");
        changes += u32::from(found[0] != before);
        before = found[0];
    }
    assert!(changes > 0, "no child wrote anything");
    check_parts_go(folder.path());
}

/// What the killed programs left goes once it is old, and the file stays.
fn check_parts_go(folder: &Path) {
    let paths = || -> Vec<PathBuf> {
        let entries = fs::read_dir(folder).expect("readable");
        entries.map(|e| e.expect("readable").path()).collect()
    };
    for path in paths() {
        let file = fs::OpenOptions::new().append(true).open(path);
        let age = SystemTime::now() - Duration::from_secs(3600);
        file.and_then(|file| file.set_modified(age))
            .expect("writable");
    }
    assert!(paths().len() > 1, "no child was killed while it wrote");
    remove_abandoned_parts(folder);
    assert_eq!(paths(), [folder.join("file")]);
}
