//! Names that level editors give to materials of faces which no player sees: skies, triggers, clips and the like.

/// Names in Quake, its successors, Source and TrenchBroom, in lower case, without folder and without Source's `tools`.
const TOOL_NAMES: [&str; 41] = [
    "sky",
    "skybox",
    "skybox2d",
    "skip",
    "hint",
    "hintskip",
    "hint_skip",
    "trigger",
    "clip",
    "fullclip",
    "full_clip",
    "playerclip",
    "player_clip",
    "monsterclip",
    "npcclip",
    "botclip",
    "weapclip",
    "weaponclip",
    "missileclip",
    "grenadeclip",
    "controlclip",
    "invisible",
    "invisibleladder",
    "nodraw",
    "nodrawnonsolid",
    "caulk",
    "areaportal",
    "clusterportal",
    "antiportal",
    "occluder",
    "donotenter",
    "lightgrid",
    "blocklight",
    "block_light",
    "blockbullets",
    "block_bullets",
    "block_los",
    "blocklos",
    "blockbomb",
    "origin",
    "fog",
];

/// Endings of files that exporters leave on names.
const IMAGE_ENDINGS: [&str; 6] = [".png", ".tga", ".jpg", ".vmt", ".vtf", ".wal"];

/// True if a material is named like a tool texture: the whole name, or what stands after its last folder, is one of
/// [`TOOL_NAMES`], also with `tools` before it as in Source, with a number or an image's ending after it.
pub(super) fn is_tool(name: &str) -> bool {
    let name = name.trim().to_lowercase();
    let mut tail = name.rsplit(['/', '\\']).next().unwrap_or_default();
    for ending in IMAGE_ENDINGS {
        tail = tail.strip_suffix(ending).unwrap_or(tail);
    }
    tail = without_copy_number(tail);
    let is_known = |name: &str| TOOL_NAMES.contains(&name);
    is_known(tail)
        || tail.strip_prefix("tools").is_some_and(is_known)
        // Quake takes every texture named so for the sky.
        || tail.strip_prefix("sky").is_some_and(|rest| rest.parse::<u32>().is_ok())
}

/// Blender names copies `sky.001`.
fn without_copy_number(name: &str) -> &str {
    match name.rsplit_once('.') {
        Some((start, number)) if number.len() == 3 && number.parse::<u32>().is_ok() => start,
        _ => name,
    }
}

/// True if a name fits a pattern, in which `*` stands for any text.
pub(super) fn fits(pattern: &str, name: &str) -> bool {
    let mut parts = pattern.split('*');
    let first = parts.next().unwrap_or_default();
    let Some(mut rest) = name.strip_prefix(first) else {
        return false;
    };
    let Some(last) = parts.next_back() else {
        return rest.is_empty();
    };
    // What comes first is found first, which leaves most for the parts after it.
    for part in parts {
        let Some(at) = rest.find(part) else {
            return false;
        };
        rest = &rest[at + part.len()..];
    }
    rest.ends_with(last)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_level_editors_are_known_and_others_are_not() {
        for name in [
            "sky",
            "Sky3",
            "trigger",
            "common/caulk",
            "textures/common/clip.tga",
            "TOOLS/TOOLSNODRAW",
            "tools\\toolsskybox",
            "toolsareaportal",
            "sky.001",
            "__TB_empty/skip",
        ] {
            assert!(is_tool(name), "{name}");
        }
        for name in [
            "",
            "brick",
            "skylight",
            "sky_blue",
            "paperclip",
            "tools/toolsblack",
            "skip/brick",
            "trigger_wall",
            "sky.blue",
        ] {
            assert!(!is_tool(name), "{name}");
        }
    }

    #[test]
    fn stars_stand_for_any_text() {
        for (pattern, name) in [
            ("a", "a"),
            ("*", ""),
            ("a*", "a"),
            ("*b", "ab"),
            ("a*c*e", "abcde"),
            ("**", "x"),
            ("a*a", "aa"),
            ("*ab*ab", "abab"),
        ] {
            assert!(fits(pattern, name), "{pattern} {name}");
        }
        for (pattern, name) in [
            ("a", "ab"),
            ("", "a"),
            ("a*a", "a"),
            ("a*c", "ab"),
            ("*ab*ab", "ab"),
            ("A", "a"),
        ] {
            assert!(!fits(pattern, name), "{pattern} {name}");
        }
    }
}
