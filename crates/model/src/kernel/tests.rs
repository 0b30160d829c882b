use pulp::Arch;

use super::{activation::SiluBackward, *};

/// Numbers in (-1, 1) without a generator.
fn ramp(len: usize, step: f32) -> Vec<f32> {
    (0..len).map(|i| (i as f32 * step).sin()).collect()
}

#[test]
fn products_agree_with_the_definition_between_one_row_and_many_and_between_vector_units() {
    let sizes = [(1, 1, 1), (5, 7, 3), (16, 300, 70), (9, 34, 136)];
    let heights = (1..=9).map(|rows| (rows, 40, 33));
    for (m, k, n) in sizes.into_iter().chain(heights) {
        let (a, w) = (ramp(m * k, 0.7), ramp(n * k, 1.3));
        let b = Panels::transposed(&w, k, n);
        let mut packed = Vec::new();
        pack_rows(&mut packed, &a, (m, k), (k, 1));
        let start = ramp(m * n, 0.1);
        let mut found: Vec<Vec<f32>> = Vec::new();
        for arch in instruction_sets() {
            let mut c = start.clone();
            multiply_rows(arch, &mut c, m, &packed, &b);
            for row in 0..m {
                let mut y = start[row * n..][..n].to_vec();
                multiply_row(arch, &mut y, &a[row * k..][..k], &b);
                assert_eq!(y, c[row * n..][..n], "row {row} of {m}x{k}x{n}, {arch:?}");
                for (column, got) in y.iter().enumerate() {
                    let exact: f64 = (0..k)
                        .map(|i| f64::from(a[row * k + i]) * f64::from(w[column * k + i]))
                        .sum::<f64>()
                        + f64::from(start[row * n + column]);
                    assert!(
                        (f64::from(*got) - exact).abs() < 1e-4,
                        "{got} against {exact}"
                    );
                }
            }
            found.push(c);
        }
        // The portable path rounds products before it adds them.
        for pair in found[1..].windows(2) {
            assert_eq!(pair[0], pair[1], "{m}x{k}x{n}");
        }
    }
}

#[test]
fn transposed_rows_give_the_product_of_the_transpose() {
    let (m, k, n) = (6, 10, 33);
    let (a, b) = (ramp(k * m, 0.3), ramp(k * n, 0.9));
    let mut packed = Vec::new();
    pack_rows(&mut packed, &a, (m, k), (1, m));
    let mut c = vec![0.0; m * n];
    f32::multiply(&mut c, m, &packed, &Panels::new(&b, k, n));
    for row in 0..m {
        for column in 0..n {
            let exact: f32 = (0..k).map(|i| a[i * m + row] * b[i * n + column]).sum();
            assert!((c[row * n + column] - exact).abs() < 1e-5);
        }
    }
}

#[test]
fn silu_and_its_derivative_are_exact_to_single_precision() {
    let x: Vec<f32> = (-2000..=2000)
        .map(|i| i as f32 * 0.0517)
        .chain([0.0, 1e30, -1e30, f32::MAX, f32::MIN, 1e-40, -1e-40])
        .collect();
    for arch in instruction_sets() {
        let (mut y, mut slope) = (x.clone(), x.clone());
        silu(arch, &mut y);
        arch.dispatch(SiluBackward(&mut slope, &vec![1.0; x.len()]));
        for ((x, y), slope) in x.iter().zip(&y).zip(&slope) {
            let (x, y, slope) = (f64::from(*x), f64::from(*y), f64::from(*slope));
            let gate = 1.0 / (1.0 + (-x).exp());
            let exact = x * gate;
            assert!(
                (y - exact).abs() <= 3e-7 * exact.abs() + 1e-35,
                "{arch:?}: silu({x}) = {y}"
            );
            let exact = gate * (1.0 + x * (1.0 - gate));
            assert!(
                (slope - exact).abs() < 1e-6,
                "{arch:?}: slope({x}) = {slope}, not {exact}"
            );
        }
        let mut none = [f32::NAN; 5];
        silu(arch, &mut none);
        assert!(
            none.iter().all(|y| y.is_nan()),
            "{arch:?} hides what is no number"
        );
    }
}

#[test]
fn the_sigmoid_agrees_with_f64_saturates_and_hides_nothing() {
    for arch in instruction_sets() {
        let x: Vec<f32> = (-4000..=4000).map(|i| i as f32 * 0.03).collect();
        let mut found = x.clone();
        sigmoid(arch, &mut found);
        for (x, y) in x.iter().zip(&found) {
            let exact = 1.0 / (1.0 + (-f64::from(*x)).exp());
            assert!((f64::from(*y) - exact).abs() < 2e-7, "{arch:?} {x}: {y}");
        }
        let mut wild = [
            f32::INFINITY,
            f32::NEG_INFINITY,
            f32::MAX,
            f32::MIN,
            f32::NAN,
        ];
        sigmoid(arch, &mut wild);
        assert!((wild[0] - 1.0).abs() < 1e-6 && (wild[2] - 1.0).abs() < 1e-6);
        assert!(wild[1] < 1e-30 && wild[3] < 1e-30, "{arch:?}: {wild:?}");
        assert!(wild[4].is_nan(), "{arch:?} hides what is no number");
        let mut none = [f32::NAN; 37];
        sigmoid(arch, &mut none);
        assert!(
            none.iter().all(|y| y.is_nan()),
            "{arch:?} hides what is no number"
        );
    }
}

#[test]
fn a_softmax_of_scores_far_apart_is_a_choice() {
    struct Softmax<'a>(&'a mut [f32]);
    impl pulp::WithSimd for Softmax<'_> {
        type Output = ();

        #[inline(always)]
        fn with_simd<S: pulp::Simd>(self, simd: S) {
            softmax(simd, self.0);
        }
    }
    for arch in instruction_sets() {
        for len in [1, 3, 16, 37] {
            let mut values: Vec<f32> = (0..len).map(|i| -1e5 * i as f32 + 3e4).collect();
            arch.dispatch(Softmax(&mut values));
            assert!((values[0] - 1.0).abs() < 1e-6, "{arch:?}: {values:?}");
            assert!(values[1..].iter().all(|value| *value < 1e-30));
            let mut values: Vec<f32> = (0..len).map(|i| (i as f32).sin()).collect();
            let exact: Vec<f64> = values.iter().map(|v| f64::from(*v).exp()).collect();
            let sum: f64 = exact.iter().sum();
            arch.dispatch(Softmax(&mut values));
            for (value, exact) in values.iter().zip(exact) {
                assert!((f64::from(*value) - exact / sum).abs() < 1e-6);
            }
        }
    }
}

/// Every instruction set that the kernels have and this machine too; the portable one first.
pub(crate) fn instruction_sets() -> Vec<Arch> {
    let mut sets = vec![Arch::Scalar];
    #[cfg(target_arch = "x86_64")]
    {
        sets.extend(pulp::x86::V3::try_new().map(Arch::V3));
        sets.extend(pulp::x86::V4::try_new().map(Arch::V4));
    }
    #[cfg(target_arch = "aarch64")]
    sets.extend(pulp::aarch64::Neon::try_new().map(Arch::Neon));
    sets
}
