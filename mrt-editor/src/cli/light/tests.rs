use super::*;
use crate::cli::map::{MapArgs, run as run_map};
use clap::Parser;
use std::ffi::OsString;
use std::fs;
use std::path::Path;

#[derive(Parser)]
struct MapLine {
    #[command(flatten)]
    args: MapArgs,
}

#[derive(Parser)]
struct LightLine {
    #[command(flatten)]
    args: LightArgs,
}

/// A room of 4 x 3 x 4 m, seen from inside.
const ROOM: &str = "v 0 0 0\nv 4 0 0\nv 0 3 0\nv 4 3 0\nv 0 0 4\nv 4 0 4\nv 0 3 4\nv 4 3 4\n\
    f 1 5 6 2\nf 3 4 8 7\nf 1 2 4 3\nf 5 7 8 6\nf 1 3 7 5\nf 2 6 8 4\n";

fn words(command: &str, folder: &Path) -> Vec<OsString> {
    let place = folder.display().to_string();
    let words = command
        .split(' ')
        .map(|word| word.replace('@', &place).into());
    std::iter::once("mrt".into()).chain(words).collect()
}

fn light(folder: &Path, more: &str) -> Result<(), LightCommandError> {
    let command = format!("--scene @/room.obj --level @/level.toml --out @/out {more}");
    run(&LightLine::parse_from(words(command.trim(), folder)).args)
}

fn mapped_room() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("room.obj"), ROOM).expect("writes");
    let command = "--scene @/room.obj --out @/level.toml --json";
    let line = MapLine::parse_from(words(command, folder.path()));
    run_map(&line.args).expect("maps");
    folder
}

/// Luminance of each pixel of a picture, encoded as sRGB.
fn luminances(path: &Path) -> Vec<u8> {
    image::open(path).expect("a picture").to_luma8().into_raw()
}

#[test]
fn a_room_is_mapped_and_lit() {
    let folder = mapped_room();
    light(folder.path(), "--size 32x18 --json").expect("lights");
    let out = folder.path().join("out");
    for file in [
        "view1.png",
        "overview-direct.png",
        "lightmap.hdr",
        "mesh.obj",
        "mesh.mtl",
    ] {
        assert!(out.join(file).exists(), "{file}");
    }
    // Nothing but the scene, the level and the pictures.
    assert_eq!(fs::read_dir(folder.path()).expect("reads").count(), 3);
    let picture = luminances(&out.join("view1-indirect.png"));
    let lit = picture.iter().filter(|&&value| value > 10).count();
    assert!(lit > 32 * 18 / 2, "{lit} lit pixels");
}

#[test]
fn shadow_rays_and_openings_agree_in_an_empty_room() {
    let folder = mapped_room();
    let mean = |shadows: &str| {
        light(
            folder.path(),
            &format!("--size 16x9 --shadows {shadows} --exposure 0"),
        )
        .expect("lights");
        let picture = luminances(&folder.path().join("out/view1-indirect.png"));
        picture.into_iter().map(u64::from).sum::<u64>()
    };
    assert_eq!(mean("openings"), mean("rays"));
}

#[test]
fn bad_lights_are_refused_and_nothing_is_written() {
    let folder = mapped_room();
    let error = |more: &str| {
        let error = light(folder.path(), &format!("--size 8x8 {more}")).expect_err("refused");
        assert!(!folder.path().join("out").exists());
        error.to_string()
    };
    assert!(error("--light 9,1,1,5").contains("lies in no block"));
    assert!(error("--light nan,1,1,5").contains("position"));
    assert!(error("--light 1,1,1,-5").contains("intensity"));
    assert!(error("--light 1,1,1,inf").contains("intensity"));
    assert!(error("--camera 1,1,1;1,1,1").contains("two different points"));
    assert!(error("--dictionary @/room.obj").contains("room.obj"));
}

#[test]
fn lights_behind_faces_are_in_a_wall() {
    let folder = mapped_room();
    // A box of solid rock in the middle of the room's floor.
    let rock = "v 1 0 1\nv 2 0 1\nv 1 1 1\nv 2 1 1\nv 1 0 2\nv 2 0 2\nv 1 1 2\nv 2 1 2\n\
        f 9 10 14 13\nf 11 15 16 12\nf 9 11 12 10\nf 13 14 16 15\nf 9 13 15 11\nf 10 12 16 14\n";
    fs::write(folder.path().join("room.obj"), format!("{ROOM}{rock}")).expect("writes");
    let error = light(folder.path(), "--size 8x8 --light 1.5,0.5,1.5,5").expect_err("refused");
    assert!(
        matches!(error, LightCommandError::InWall { light: 0, .. }),
        "{error}"
    );
}

#[test]
fn truncated_files_leave_nothing() {
    let folder = mapped_room();
    let level = fs::read_to_string(folder.path().join("level.toml")).expect("reads");
    for cut in [0, 10, level.len() / 2] {
        fs::write(folder.path().join("level.toml"), &level[..cut]).expect("writes");
        assert!(light(folder.path(), "").is_err());
    }
    assert!(!folder.path().join("out").exists());
}
