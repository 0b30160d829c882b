//! The space that overlapping solids have in common, in small cells: what their sum counts too often.

use nalgebra::Vector3;

use super::{part::Part, solid::Solid};

/// Cells along each axis of the box about what overlaps.
const CELLS: usize = 16;
/// Points along each edge of a cell that say how much of it is shared.
const POINTS: usize = 3;

/// Space that is in more than one solid, counted once less than the number of them; body frame.
///
/// It is known in cells, a sixteenth of its box along each axis: its volume to about a hundredth.
#[derive(Clone, Debug)]
pub(super) struct Shared {
    cells: Vec<Cell>,
    /// Edges of a cell [m].
    edges: Vector3<f64>,
    whole: Part,
}

#[derive(Clone, Copy, Debug)]
struct Cell {
    /// Middle of what is shared in it [m].
    middle: Vector3<f64>,
    /// Volume that counts too often [m^3].
    volume: f64,
}

impl Shared {
    /// Common space of these solids, of which these pairs overlap; `None` where no pair does.
    pub(super) fn of(solids: &[Solid], pairs: &[(usize, usize)]) -> Option<Self> {
        let boxes: Vec<_> = solids.iter().map(bounding_box).collect();
        let common = pairs.iter().map(|&(one, other)| {
            (
                boxes[one].0.sup(&boxes[other].0),
                boxes[one].1.inf(&boxes[other].1),
            )
        });
        let (low, high) = common.reduce(|all, one| (all.0.inf(&one.0), all.1.sup(&one.1)))?;
        let edges = (high - low) / CELLS as f64;
        let cells: Vec<Cell> = (0..CELLS * CELLS * CELLS)
            .filter_map(|at| {
                cell(
                    solids,
                    low + lattice(at, CELLS).component_mul(&edges),
                    &edges,
                )
            })
            .collect();
        let whole = cells.iter().map(|cell| cell.part(1.0)).sum();
        Some(Self {
            cells,
            edges,
            whole,
        })
    }

    pub(super) fn whole(&self) -> Part {
        self.whole
    }

    /// The part of it with `up.x <= level`; continuous in attitude and level.
    pub(super) fn below(&self, up: &Vector3<f64>, level: f64) -> Part {
        let height = self.edges.dot(&up.abs());
        let share = |cell: &Cell| (0.5 + (level - up.dot(&cell.middle)) / height).clamp(0.0, 1.0);
        self.cells.iter().map(|cell| cell.part(share(cell))).sum()
    }
}

impl Cell {
    fn part(&self, share: f64) -> Part {
        let volume = self.volume * share;
        Part {
            volume,
            moment: volume * self.middle,
        }
    }
}

/// Corners of a box about a solid, along the body's axes.
fn bounding_box(solid: &Solid) -> (Vector3<f64>, Vector3<f64>) {
    let reach = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| solid.reach(&axis));
    (
        Vector3::from(reach.map(|(low, _)| low)),
        Vector3::from(reach.map(|(_, high)| high)),
    )
}

/// Point of a lattice of `count` points along each axis, in steps from its corner.
fn lattice(at: usize, count: usize) -> Vector3<f64> {
    Vector3::new(
        (at % count) as f64,
        (at / count % count) as f64,
        (at / count / count) as f64,
    )
}

/// Cell of a corner with its share of that space; `None` where it has none.
fn cell(solids: &[Solid], corner: Vector3<f64>, edges: &Vector3<f64>) -> Option<Cell> {
    let step = edges / POINTS as f64;
    let (mut times, mut moment) = (0, Vector3::zeros());
    for at in 0..POINTS * POINTS * POINTS {
        let middle = lattice(at, POINTS) + Vector3::repeat(0.5);
        let point = corner + middle.component_mul(&step);
        let inside = solids.iter().filter(|solid| solid.contains(&point));
        let too_often = inside.count().saturating_sub(1);
        times += too_often;
        moment += too_often as f64 * point;
    }
    (times > 0).then(|| Cell {
        middle: moment / times as f64,
        volume: times as f64 * step.product(),
    })
}
