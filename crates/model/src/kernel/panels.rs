//! Matrices laid out for the products: B in panels of columns, A in groups of rows.

/// Columns of B that lie together.
pub(crate) const PANEL: usize = 32;
/// Rows of A that lie together.
pub(super) const ROWS: usize = 8;

/// B [k,n], packed: [ceil(n / PANEL)][k][PANEL], padded with zeros.
#[derive(Clone, Debug, Default)]
pub(crate) struct Panels<T> {
    pub(super) depth: usize,
    pub(super) columns: usize,
    data: Vec<[T; PANEL]>,
}

impl<T: Copy + Default> Panels<T> {
    /// B itself, row-major [k,n].
    pub(crate) fn new(data: &[T], depth: usize, columns: usize) -> Self {
        let mut panels = Self::default();
        panels.pack(data, depth, columns, columns);
        panels
    }

    /// B = W^T of a row-major W [n,k], as a layer's weight is stored.
    pub(crate) fn transposed(weight: &[T], depth: usize, columns: usize) -> Self {
        let mut data = vec![[T::default(); PANEL]; depth * columns.div_ceil(PANEL)];
        for (column, row) in weight.chunks_exact(depth).enumerate() {
            let panel = &mut data[column / PANEL * depth..][..depth];
            for (slot, value) in panel.iter_mut().zip(row) {
                slot[column % PANEL] = *value;
            }
        }
        Self {
            depth,
            columns,
            data,
        }
    }

    /// Packs the first `columns` of each of `depth` rows of length `stride`, reusing memory.
    pub(crate) fn pack(&mut self, data: &[T], depth: usize, columns: usize, stride: usize) {
        self.depth = depth;
        self.columns = columns;
        self.data.clear();
        self.data
            .resize(depth * columns.div_ceil(PANEL), [T::default(); PANEL]);
        for (row, values) in data.chunks(stride).take(depth).enumerate() {
            for (panel, part) in values[..columns].chunks(PANEL).enumerate() {
                self.data[panel * depth + row][..part.len()].copy_from_slice(part);
            }
        }
    }

    /// From rows of panels as [`Panels::rows`] gives them.
    pub(super) fn from_rows(depth: usize, columns: usize, data: Vec<[T; PANEL]>) -> Self {
        Self {
            depth,
            columns,
            data,
        }
    }

    /// Every panel's rows, panel after panel.
    pub(super) fn rows(&self) -> impl Iterator<Item = &[T; PANEL]> {
        self.data.iter()
    }

    /// n.
    pub(crate) fn columns(&self) -> usize {
        self.columns
    }

    /// Panel `index` [k][PANEL].
    pub(super) fn panel(&self, index: usize) -> &[[T; PANEL]] {
        &self.data[index * self.depth..][..self.depth]
    }
}

/// Packs A [rows,k] as [ceil(rows / ROWS)][k][ROWS]; element (r, k) lies at `r * row_stride + k * depth_stride`.
pub(crate) fn pack_rows<T: Copy + Default>(
    packed: &mut Vec<T>,
    a: &[T],
    (rows, depth): (usize, usize),
    (row_stride, depth_stride): (usize, usize),
) {
    packed.clear();
    packed.resize(rows.div_ceil(ROWS) * ROWS * depth, T::default());
    for (block, group) in packed.chunks_exact_mut(ROWS * depth).enumerate() {
        let first = block * ROWS;
        let height = ROWS.min(rows - first);
        if depth_stride == 1 {
            for r in 0..height {
                let row = &a[(first + r) * row_stride..][..depth];
                for (slot, value) in group.chunks_exact_mut(ROWS).zip(row) {
                    slot[r] = *value;
                }
            }
        } else {
            for (k, slot) in group.chunks_exact_mut(ROWS).enumerate() {
                for (r, value) in slot[..height].iter_mut().enumerate() {
                    *value = a[(first + r) * row_stride + k * depth_stride];
                }
            }
        }
    }
}
