use proptest::prelude::*;

use super::*;
use crate::kernel::instruction_sets;

/// Y of X [rows,k] and W [n,k], from `start` [rows,n].
fn found(arch: Arch, start: &[f32], x: &[f32], w: &[f32], depth: usize) -> Vec<f32> {
    let b = Int16Panels::new(&Panels::transposed(w, depth, w.len() / depth));
    let mut y = start.to_vec();
    let mut scratch = vec![f32::NAN; x.len() / depth * b.scratch()];
    multiply_int16(arch, &mut y, x, &b, &mut scratch);
    y
}

/// Whole numbers of `values` with the largest `most`, and their scale, by division and rounding in f64.
fn rounded(values: &[f32], most: f32) -> (Vec<i64>, f32) {
    let largest = values.iter().fold(0.0f32, |a, b| a.max(b.abs()));
    let inverse = if largest > 0.0 { most / largest } else { 0.0 };
    let whole = values
        .iter()
        .map(|value| f64::from(value * inverse).round_ties_even() as i64);
    (whole.collect(), largest / most)
}

/// One element by the definition: exact sums in i64, then the scales in the order that the module states.
fn defined(start: f32, x: &[f32], w: &[f32]) -> f32 {
    let (w, scale) = rounded(w, WEIGHT);
    let mut sum = 0.0f32;
    for (x, w) in x.chunks(BLOCK).zip(w.chunks(BLOCK)) {
        let (x, scale) = rounded(x, ACTIVATION);
        let exact: i64 = x.iter().zip(w).map(|(x, w)| x * w).sum();
        assert!(i32::try_from(exact).is_ok());
        sum += exact as f32 * scale;
    }
    start + sum * scale
}

fn check(rows: usize, depth: usize, start: &[f32], x: &[f32], w: &[f32]) {
    let columns = w.len() / depth;
    let want: Vec<f32> = (0..rows * columns)
        .map(|at| {
            let (row, column) = (at / columns, at % columns);
            defined(
                start[at],
                &x[row * depth..][..depth],
                &w[column * depth..][..depth],
            )
        })
        .collect();
    for arch in instruction_sets() {
        assert_eq!(
            found(arch, start, x, w, depth),
            want,
            "{arch:?} {rows}x{depth}x{columns}"
        );
    }
}

/// Rows, k, n, and three seeds of numbers.
fn products() -> impl Strategy<Value = (usize, usize, usize, Vec<f32>)> {
    let number = prop_oneof![
        4 => -3.0f32..3.0,
        1 => Just(0.0),
        1 => -1e6f32..1e6,
        1 => -1e-6f32..1e-6,
    ];
    (1usize..4, 1usize..150, 1usize..80).prop_flat_map(move |(rows, depth, columns)| {
        let count = rows * columns + rows * depth + columns * depth;
        (
            Just(rows),
            Just(depth),
            Just(columns),
            proptest::collection::vec(number.clone(), count),
        )
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn products_are_exact_in_whole_numbers_whatever_the_sizes((rows, depth, columns, numbers) in products()) {
        let (start, rest) = numbers.split_at(rows * columns);
        let (x, w) = rest.split_at(rows * depth);
        check(rows, depth, start, x, w);
    }
}

/// Every product of a block as large as can be: int32 holds the sum.
#[test]
fn the_largest_sum_does_not_overflow() {
    for (depth, sign) in [(BLOCK, 1.0), (BLOCK, -1.0), (3 * BLOCK + 5, -1.0)] {
        let (x, w) = (vec![2.5; depth], vec![sign * 0.75; 33 * depth]);
        check(1, depth, &[0.0; 33], &x, &w);
        let y = found(Arch::new(), &[0.0], &x, &w[..depth], depth);
        let exact = sign * 2.5 * 0.75 * depth as f32;
        assert!((y[0] - exact).abs() < 1e-6 * exact.abs(), "{y:?} {exact}");
    }
}

#[test]
fn the_error_is_that_of_the_rounding() {
    let (depth, columns) = (512, 40);
    let wave =
        |len: usize, step: f32| -> Vec<f32> { (0..len).map(|i| (i as f32 * step).sin()).collect() };
    let (x, w) = (wave(depth, 0.7), wave(depth * columns, 1.3));
    let y = found(Arch::new(), &vec![0.0; columns], &x, &w, depth);
    for (y, w) in y.iter().zip(w.chunks_exact(depth)) {
        let products = x.iter().zip(w).map(|(x, w)| f64::from(*x) * f64::from(*w));
        let (exact, size) = products.fold((0.0, 0.0), |(s, q), p| (s + p, q + p * p));
        let error = (f64::from(*y) - exact).abs();
        assert!(error < 1e-3 * f64::sqrt(size), "{error} of {}", size.sqrt());
    }
}

#[test]
fn an_outlier_leaves_the_other_blocks_their_digits() {
    let mut x = vec![0.5; 2 * BLOCK];
    x[3] = 1e6;
    let mut w = vec![1.0; 2 * BLOCK];
    w[..BLOCK].fill(0.0);
    for arch in instruction_sets() {
        let y = found(arch, &[0.0], &x, &w, 2 * BLOCK);
        assert!((y[0] - 32.0).abs() < 1e-3, "{arch:?}: {y:?}");
    }
}

#[test]
fn what_is_no_number_is_not_hidden() {
    for arch in instruction_sets() {
        for wild in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            for at in [0, 5, 69] {
                let mut x = vec![0.5; 70];
                x[at] = wild;
                let y = found(arch, &[0.0; 3], &x, &[0.25; 210], 70);
                assert!(y.iter().all(|y| !y.is_finite()), "{arch:?} {wild}: {y:?}");
            }
        }
        // Too small for a scale: next to nothing.
        let y = found(arch, &[1.0], &[1e-40, -1e-42], &[1e-41, 1.0], 2);
        assert_eq!(y, [1.0], "{arch:?}");
        let y = found(arch, &[2.0], &[0.0; 9], &[0.0; 9], 9);
        assert_eq!(y, [2.0], "{arch:?}");
    }
}
