//! Walls of nodes: draw a path, try it on a virtual bean, save it, and see what the nodes of a real wall said.

use std::path::Path;

use serde::{Deserialize, Serialize};
use tropism::nodes::WallPath;
use tropism_bean::Species;
use tropism_bean::wall::WallTrial;
use tropism_lab::files::{self, shell_word};
use tropism_lab::wall::WallFile;
use tropism_page::{GrownBeforeWall, NodeState, ShownWall, WallPicture, WallRule, grow_before_wall, shown};

use crate::begin::files_below;
use crate::draw::check_name;
use crate::error::Refusal;
use crate::{Studio, found, jobs};

/// The journal of a watched wall, beside its wall file.
const JOURNAL: &str = "nodes.csv";
/// Steps of a journal that are shown: a day of five-minute steps.
const SHOWN_STEPS: usize = 288;
/// The largest end of a journal that is read: some days of sixteen nodes.
const MOST_BYTES: usize = 1 << 20;

/// Wall files, and folders in which a wall is watched.
#[derive(Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(crate) struct Walls {
    files: Vec<String>,
    watched: Vec<String>,
}

/// All walls below the folder of the studio.
pub(crate) fn walls(root: &Path) -> Walls {
    let below = files_below(root);
    let folder_of = |at: &String| at.rsplit_once('/').map_or("", |(folder, _)| folder).to_owned();
    let is_journal = |at: &&String| at.rsplit('/').next() == Some(JOURNAL);
    let is_watched = |folder: &String| root.join(folder).join("wall.toml").is_file();
    let watched: Vec<String> = below.iter().filter(is_journal).map(folder_of).filter(is_watched).collect();
    let is_wall = |at: &String| {
        let text = files::read_text(&root.join(at)).unwrap_or_default();
        text.lines().any(|line| line.trim() == "[wall]")
    };
    let files = below.into_iter().filter(|at| at.ends_with(".toml") && !watched.contains(&folder_of(at)));
    Walls { files: files.filter(is_wall).collect(), watched }
}

/// A wall with the path that a page drew.
#[derive(Debug, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct DrawnWall {
    /// Wall file; empty for the wall of three levels.
    #[serde(default)]
    file: String,
    /// Names of the nodes on the path, lowest first, with commas between them; the path of the file if it is empty.
    #[serde(default)]
    path: String,
}

impl DrawnWall {
    fn read(&self, root: &Path) -> Result<WallFile, Refusal> {
        let mut file = match &*self.file {
            "" => WallFile::default(),
            at => WallFile::read(&found::resolve(root, at)?)?,
        };
        if !self.path.is_empty() {
            file.wall.path = WallPath::Drawn(self.path.split(',').map(str::to_owned).collect());
        }
        file.check()?;
        Ok(file)
    }
}

/// The wall as it is drawn.
pub(crate) fn drawn(studio: &Studio, wall: &DrawnWall) -> Result<ShownWall, Refusal> {
    Ok(shown(&wall.read(&studio.root)?.wall))
}

/// A plant to be led.
#[derive(Debug, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct TryWall {
    /// Wall file; empty for the wall of three levels.
    #[serde(default)]
    file: String,
    /// Names of the nodes on the path, lowest first, with commas between them.
    path: String,
    rule: WallRule,
    /// Seed of the plant.
    seed: u64,
}

/// Grows a plant before the wall.
pub(crate) fn try_out(
    studio: &Studio,
    TryWall { file, path, rule, seed }: TryWall,
) -> Result<GrownBeforeWall, Refusal> {
    let file = DrawnWall { file, path }.read(&studio.root)?;
    let trial = WallTrial {
        wall: file.wall,
        sensor: file.sensor,
        camera: file.camera,
        ..WallTrial::new(Species::default())
    };
    Ok(grow_before_wall(&trial, file.machine, rule, seed))
}

/// A wall to be saved.
#[derive(Debug, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct SaveWall {
    name: String,
    #[serde(default)]
    file: String,
    path: String,
}

/// A wall file that was written.
#[derive(Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(crate) struct SavedWall {
    file: String,
    /// Commands that use it.
    commands: Vec<String>,
}

/// Writes a wall file. Another file of this name is an error.
pub(crate) fn save(studio: &Studio, SaveWall { name, file, path }: SaveWall) -> Result<SavedWall, Refusal> {
    check_name(&name)?;
    let wall = DrawnWall { file, path }.read(&studio.root)?;
    let at = format!("{name}.toml");
    let target = studio.root.join(&at);
    let text = files::toml_of(&target, &wall)?;
    match files::read_text(&target) {
        Ok(known) if known != text => {
            return Err(Refusal::bad(format!("{at}: another file has this name: choose a new one")));
        }
        Ok(_) => {}
        Err(_) => files::write(&target, text.as_bytes())?,
    }
    let nodes = wall.wall.nodes.iter().map(|node| {
        ["node", &node.name, "--wall", &at, "--broker", "localhost", "--experiment", &name].map(str::to_owned)
    });
    let line = |words: &[&str]| jobs::line(&words.iter().map(|&word| word.to_owned()).collect::<Vec<_>>());
    let mut commands =
        vec![line(&["wall", &at, "--rules", "machine,dormant", "--out", &format!("{name}-beans")])];
    commands.extend(nodes.map(|words| jobs::line(&words)));
    let watched = format!("{name}-watched");
    commands.push(line(&[
        "watch-wall",
        &at,
        "--broker",
        "localhost",
        "--experiment",
        &name,
        "--start",
        "--out",
        &watched,
    ]));
    Ok(SavedWall { file: at, commands })
}

/// What the nodes of a real wall said last.
#[derive(Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(crate) struct WatchedWall {
    wall: ShownWall,
    /// A picture a step.
    pictures: Vec<WallPicture>,
    /// The command that watches it.
    command: String,
}

/// The latest steps of a watched wall.
pub(crate) fn watched(studio: &Studio, at: &str) -> Result<WatchedWall, Refusal> {
    let folder = found::resolve(&studio.root, at)?;
    let file = WallFile::read(&folder.join("wall.toml"))?;
    let names: Vec<&str> = file.wall.nodes.iter().map(|node| node.name.as_str()).collect();
    let bytes = files::read(&folder.join(JOURNAL))?;
    let text = String::from_utf8_lossy(&bytes[bytes.len().saturating_sub(MOST_BYTES)..]).into_owned();
    let mut pictures: Vec<(u32, WallPicture)> = Vec::new();
    for row in text.lines() {
        let Some((step, node, state)) = read_row(row, &names) else { continue };
        // Nodes of one step write one after the other; a late one belongs to its own.
        let place = pictures.partition_point(|(known, _)| *known < step);
        if pictures.get(place).is_none_or(|(known, _)| *known != step) {
            let nodes = vec![None; names.len()];
            pictures
                .insert(place, (step, WallPicture { when: format!("step {step}"), stem: Vec::new(), nodes }));
        }
        pictures[place].1.nodes[node] = Some(state);
    }
    let first = pictures.len().saturating_sub(SHOWN_STEPS);
    let pictures = pictures.split_off(first).into_iter().map(|(_, picture)| picture).collect();
    let [wall, out] = [format!("{at}/wall.toml"), at.to_owned()].map(|path| shell_word(Path::new(&path)));
    let command = format!("tropism watch-wall {wall} --experiment NAME --out {out}");
    Ok(WatchedWall { wall: shown(&file.wall), pictures, command })
}

/// Step, node and state of a row of the journal; `None` of the head and of half a row.
fn read_row(row: &str, names: &[&str]) -> Option<(u32, usize, NodeState)> {
    let cells: Vec<&str> = row.split(',').collect();
    let [step, node, _, level, sees, done, _] = cells[..] else { return None };
    let node = names.iter().position(|name| *name == node)?;
    let state = NodeState { level: level.parse().ok()?, sees: sees == "1", done: done == "1" };
    Some((step.parse().ok()?, node, state))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_a_journal_are_read_and_half_a_row_is_not() {
        let names = ["left1", "right1"];
        let read = |row: &str| read_row(row, &names);
        let state = NodeState { level: 255, sees: true, done: false };
        assert_eq!(read("12,right1,0.31,255,1,0,0"), Some((12, 1, state)));
        assert_eq!(read("step,node,reading,level,sees,done,lamp_is_dead"), None);
        for row in ["12,right1,0.31,255,1", "", "12,other,0.31,255,1,0,0", "12,right1,,300,1,0,0"] {
            assert_eq!(read(row), None, "{row}");
        }
    }

    #[test]
    fn walls_and_watched_folders_are_found() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        std::fs::create_dir_all(root.join("june")).unwrap();
        let wall = files::toml_of(Path::new("wall.toml"), &WallFile::default()).unwrap();
        std::fs::write(root.join("mine.toml"), &wall).unwrap();
        std::fs::write(root.join("june/wall.toml"), &wall).unwrap();
        std::fs::write(root.join("june/nodes.csv"), "step,node\n").unwrap();
        std::fs::write(root.join("rig.toml"), "[camera]\n").unwrap();
        let found = walls(root);
        assert_eq!((found.files, found.watched), (vec!["mine.toml".to_owned()], vec!["june".to_owned()]));
    }
}
