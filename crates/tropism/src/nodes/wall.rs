//! The wall: where nodes are, which are linked, and the path that is drawn.

use serde::{Deserialize, Serialize};

use crate::check::{self, OutOfRange};
use crate::lamps::{Lamp, Layout, LayoutError};
use crate::lighting::Beam;
use crate::math::vector::Vec3;
use crate::random::{NoiseStream, Purpose};

/// Nodes whose heights differ by less are on one level, in cm. Chosen: less than the size of a node.
const SAME_LEVEL_CM: f64 = 0.5;

/// One node: a lamp and a proximity sensor at one place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct NodeSpec {
    /// Name: 1 to 24 letters, digits, `-` or `_`.
    pub name: String,
    /// Place in cm from the root: x to the right, y up from the soil, z towards the camera.
    pub at: Vec3,
    /// Direction in which sensor and lamp look.
    #[serde(default = "towards_the_camera")]
    pub facing: Vec3,
    /// Angle at which the lamp has half of its intensity, in degrees: 1 to 80; without it the lamp shines all around.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub half_angle_deg: Option<f64>,
}

const fn towards_the_camera() -> Vec3 {
    [0.0, 0.0, 1.0]
}

/// The path along which the plant is to grow: names of nodes, or `"random"`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(try_from = "PathText", into = "PathText")]
pub enum WallPath {
    /// Names of nodes, lowest first.
    Drawn(Vec<String>),
    /// For each plant another walk along the links, from a node to which no link leads.
    #[default]
    Random,
}

/// A path in a file.
#[derive(Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged)]
enum PathText {
    Word(String),
    Names(Vec<String>),
}

/// The word for a random path.
const RANDOM: &str = "random";

impl TryFrom<PathText> for WallPath {
    type Error = String;

    fn try_from(text: PathText) -> Result<Self, String> {
        match text {
            PathText::Names(names) => Ok(Self::Drawn(names)),
            PathText::Word(word) if word == RANDOM => Ok(Self::Random),
            PathText::Word(word) => Err(format!("found path {word:?}, wanted {RANDOM:?} or names of nodes")),
        }
    }
}

impl From<WallPath> for PathText {
    fn from(path: WallPath) -> Self {
        match path {
            WallPath::Drawn(names) => Self::Names(names),
            WallPath::Random => Self::Word(RANDOM.to_owned()),
        }
    }
}

/// Nodes before a plant, their links and the drawn path.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct NodeWall {
    /// Irradiance of a lamp at level 255 over that of the paper's lamp, 0.0001 to 1: 1 is 6 umol/m^2/s of blue at 35 cm.
    pub power: f64,
    /// The path.
    #[serde(default)]
    pub path: WallPath,
    /// Pairs of names: from a node to one that may follow it on a path, which stands higher.
    pub links: Vec<[String; 2]>,
    /// The nodes: as many as a layout has lamps.
    #[serde(rename = "node")]
    pub nodes: Vec<NodeSpec>,
}

/// A wall that cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum WallError {
    /// The nodes are no layout of lamps.
    #[error("nodes: {0}")]
    Nodes(#[from] LayoutError),
    /// A number out of range.
    #[error(transparent)]
    Value(#[from] OutOfRange),
    /// A name of no node.
    #[error("{place}: found node {name:?}, wanted {known}")]
    Unknown {
        /// Where the name stands.
        place: &'static str,
        /// The name.
        name: String,
        /// Names of all nodes.
        known: String,
    },
    /// A link that does not lead up.
    #[error("links: the one from {from} to {to} does not lead up")]
    Down {
        /// Lower end.
        from: String,
        /// Upper end.
        to: String,
    },
    /// Two nodes of the path that are not linked.
    #[error("path: no link joins {from} and {to}")]
    Unlinked {
        /// The first node.
        from: String,
        /// The second node.
        to: String,
    },
    /// A path without nodes.
    #[error("path: there is no node; name one, or \"random\"")]
    Empty,
}

impl NodeWall {
    /// The wall of the explanation: three levels of two nodes, 8, 13 and 18 cm high and 6 cm to each side of the plant, each
    /// linked with both nodes of the next level.
    #[must_use]
    pub fn three_levels() -> Self {
        Self::levels(&[8.0, 13.0, 18.0])
    }

    /// A wall like that of [`Self::three_levels`] with pairs of nodes at other heights, in cm.
    #[must_use]
    pub fn levels(heights: &[f64]) -> Self {
        let name = |side: &str, level: usize| format!("{side}{level}");
        let node = |side: &str, x: f64, level: usize, y: f64| NodeSpec {
            name: name(side, level),
            at: [x, y, -5.0],
            facing: towards_the_camera(),
            half_angle_deg: None,
        };
        let pair = |(level, &y): (usize, &f64)| [node("left", -6.0, level, y), node("right", 6.0, level, y)];
        let join = |level| {
            [["left", "left"], ["left", "right"], ["right", "left"], ["right", "right"]]
                .map(|[from, to]| [name(from, level), name(to, level + 1)])
        };
        Self {
            power: 0.05,
            path: WallPath::Random,
            links: (1..heights.len()).flat_map(join).collect(),
            nodes: (1..).zip(heights).flat_map(pair).collect(),
        }
    }

    /// Checks the wall.
    ///
    /// # Errors
    /// [`WallError`] names the place.
    pub fn check(&self) -> Result<(), WallError> {
        self.layout()?;
        check::within("power", self.power, 0.0001..=1.0)?;
        for node in &self.nodes {
            let beam = Beam { facing: node.facing, half_angle_deg: node.half_angle_deg.unwrap_or(45.0) };
            beam.check().map_err(|error| error.in_table(&format!("node {}", node.name)))?;
        }
        for [from, to] in &self.links {
            if self.nodes[self.find("links", from)?].at[1] >= self.nodes[self.find("links", to)?].at[1] {
                return Err(WallError::Down { from: from.clone(), to: to.clone() });
            }
        }
        if let WallPath::Drawn(names) = &self.path {
            let path = names.iter().map(|name| self.find("path", name)).collect::<Result<Vec<_>, _>>()?;
            if path.is_empty() {
                return Err(WallError::Empty);
            }
            for pair in path.windows(2) {
                if !self.followers(pair[0]).contains(&pair[1]) {
                    let name = |node: usize| self.nodes[node].name.clone();
                    return Err(WallError::Unlinked { from: name(pair[0]), to: name(pair[1]) });
                }
            }
        }
        Ok(())
    }

    /// The lamps of the nodes, in their order.
    ///
    /// # Errors
    /// [`LayoutError`] for a count, a name or a place that cannot be.
    pub fn layout(&self) -> Result<Layout, LayoutError> {
        Layout::new(self.nodes.iter().map(|node| Lamp::new(&node.name, node.at)).collect())
    }

    /// The cones of the lamps, in the order of the nodes.
    #[must_use]
    pub fn beams(&self) -> Vec<Option<Beam>> {
        let beam = |node: &NodeSpec| {
            node.half_angle_deg.map(|half_angle_deg| Beam { facing: node.facing, half_angle_deg })
        };
        self.nodes.iter().map(beam).collect()
    }

    fn find(&self, place: &'static str, name: &str) -> Result<usize, WallError> {
        let known = || self.nodes.iter().map(|node| node.name.as_str()).collect::<Vec<_>>().join(", ");
        let unknown = || WallError::Unknown { place, name: name.to_owned(), known: known() };
        self.nodes.iter().position(|node| node.name == name).ok_or_else(unknown)
    }

    /// Numbers of the nodes that may follow `node` on a path.
    #[must_use]
    pub fn followers(&self, node: usize) -> Vec<usize> {
        let of = |link: &&[String; 2]| link[0] == self.nodes[node].name;
        self.links.iter().filter(of).filter_map(|[_, to]| self.find("links", to).ok()).collect()
    }

    /// Numbers of the other nodes on the same level.
    #[must_use]
    pub fn siblings(&self, node: usize) -> Vec<usize> {
        let height = self.nodes[node].at[1];
        let is_sibling =
            |&other: &usize| other != node && (self.nodes[other].at[1] - height).abs() < SAME_LEVEL_CM;
        (0..self.nodes.len()).filter(is_sibling).collect()
    }

    /// Numbers of the nodes on the path of the plant of `seed`, lowest first, of a wall that is checked.
    #[must_use]
    pub fn path_of(&self, seed: u64) -> Vec<usize> {
        if let WallPath::Drawn(names) = &self.path {
            return names.iter().filter_map(|name| self.find("path", name).ok()).collect();
        }
        let mut draws = NoiseStream::new(seed, Purpose::Nodes, [u32::MAX, 0, 0]).at(0);
        let mut pick = |among: &[usize]| among[(draws.uniform() * among.len() as f64) as usize];
        let is_first = |&node: &usize| self.links.iter().all(|[_, to]| *to != self.nodes[node].name);
        let starts: Vec<usize> = (0..self.nodes.len()).filter(is_first).collect();
        let mut path = vec![pick(&starts)];
        loop {
            let next = self.followers(path[path.len() - 1]);
            if next.is_empty() {
                return path;
            }
            path.push(pick(&next));
        }
    }

    /// Whether the plant is on the side of `node` on its level: whether no sibling is nearer to `x`, in cm. A node alone on its
    /// level has its side of the middle.
    #[must_use]
    pub fn is_nearest(&self, node: usize, x: f64) -> bool {
        let at = self.nodes[node].at[0];
        let far = |x_of: f64| (x_of - x).abs();
        let siblings = self.siblings(node);
        let is_nearer = |other: f64| far(at) < far(other);
        siblings.iter().all(|other| is_nearer(self.nodes[*other].at[0]))
            && (!siblings.is_empty() || at == 0.0 || is_nearer(-at))
    }

    /// Least distance along x between nodes of one level, in cm; `None` where no level has two.
    #[must_use]
    pub fn column_distance_cm(&self) -> Option<f64> {
        let of = |node: usize| {
            let x = self.nodes[node].at[0];
            self.siblings(node).into_iter().map(move |other| (self.nodes[other].at[0] - x).abs())
        };
        (0..self.nodes.len()).flat_map(of).min_by(f64::total_cmp)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_node_alone_on_its_level_has_its_side_of_the_middle() {
        let mut wall = NodeWall::three_levels();
        let pair: Vec<usize> = std::iter::once(0).chain(wall.siblings(0)).collect();
        assert!(wall.is_nearest(0, wall.nodes[0].at[0]) && !wall.is_nearest(0, -wall.nodes[0].at[0]));
        wall.nodes.remove(pair[1]);
        assert!(wall.is_nearest(0, wall.nodes[0].at[0]) && !wall.is_nearest(0, -wall.nodes[0].at[0]));
    }

    #[test]
    fn random_paths_follow_links_and_take_both_sides() {
        let wall = NodeWall::three_levels();
        wall.check().unwrap();
        let mut lefts = [0; 3];
        for seed in 0..400 {
            let path = wall.path_of(seed);
            assert_eq!(path.len(), 3);
            for (level, node) in path.iter().enumerate() {
                assert_eq!(node / 2, level);
                lefts[level] += usize::from(node % 2 == 0);
            }
        }
        // Binomial: 200 +- 10, so within four standard deviations.
        assert!(lefts.iter().all(|count| (160..=240).contains(count)), "{lefts:?}");
    }

    #[test]
    fn walls_that_cannot_be_are_named() {
        let wall = NodeWall::three_levels();
        let problem = |change: &dyn Fn(&mut NodeWall)| {
            let mut wall = wall.clone();
            change(&mut wall);
            wall.check().unwrap_err().to_string()
        };
        let drawn = |names: &[&str]| WallPath::Drawn(names.iter().map(|&name| name.to_owned()).collect());
        assert!(
            problem(&|wall| wall.path = drawn(&["left1", "left3"])).contains("no link joins left1 and left3")
        );
        assert!(problem(&|wall| wall.path = drawn(&["middle"])).contains("wanted left1, right1"));
        assert!(problem(&|wall| wall.path = drawn(&[])).contains("there is no node"));
        assert!(problem(&|wall| wall.links[0].reverse()).contains("does not lead up"));
        assert!(problem(&|wall| wall.power = 2.0).contains("power = 2"));
        assert!(problem(&|wall| wall.nodes.truncate(1)).contains("found 1 lamps"));
        assert!(problem(&|wall| wall.nodes[1].facing = [0.0; 3]).contains("node right1.facing"));
    }
}
