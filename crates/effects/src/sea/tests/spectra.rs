//! Spectra: size, period, directions and seeds.

use std::f64::consts::TAU;

use super::{GRAVITY, read};
use crate::sea::{Spectrum, SpectrumShape, WaveField, random};

const SEA: Spectrum = Spectrum {
    shape: SpectrumShape::Jonswap {
        peak_enhancement: 3.3,
    },
    significant_height: 0.5,
    peak_period: 5.0,
    direction: 0.4,
    spreading: None,
    components: 60,
    seed: 1,
};
const DEVELOPED: Spectrum = Spectrum {
    shape: SpectrumShape::PiersonMoskowitz,
    ..SEA
};

fn sea(spectrum: Spectrum) -> WaveField {
    let (sea, _) = WaveField::from_spectrum(&spectrum, None, GRAVITY).expect("a sea");
    sea
}

/// Mean of a power of the frequency, weighted by energy [rad/s to that power].
fn mean_power(sea: &WaveField, power: i32) -> f64 {
    let waves = sea.components();
    waves
        .iter()
        .map(|wave| wave.frequency.powi(power))
        .sum::<f64>()
        / waves.len() as f64
}

fn mean_of_seeds(spectrum: Spectrum, number: impl Fn(&WaveField) -> f64) -> (f64, f64) {
    let numbers: Vec<f64> = (0..100)
        .map(|seed| number(&sea(Spectrum { seed, ..spectrum })))
        .collect();
    let mean = numbers.iter().sum::<f64>() / 100.0;
    let variance = numbers
        .iter()
        .map(|number| (number - mean).powi(2))
        .sum::<f64>()
        / 100.0;
    (mean, variance.sqrt())
}

#[test]
fn the_significant_height_is_the_asked_one() {
    for spectrum in [SEA, DEVELOPED] {
        for components in [20, 60, 333, 1000] {
            let field = sea(Spectrum {
                components,
                ..spectrum
            });
            assert_eq!(field.components().len(), components);
            assert!((field.significant_height() - 0.5).abs() < 1e-14);
        }
    }
    // A day at one place: four standard deviations of the elevation.
    let field = sea(SEA);
    let squares = (0..86_400).map(|second| field.elevation(2.0, 3.0, f64::from(second)).powi(2));
    let height = 4.0 * (squares.sum::<f64>() / 86_400.0).sqrt();
    assert!((height - 0.5).abs() < 0.005, "{height}");
}

/// Mean period and zero-crossing period in parts of the peak's, of the spectrum cut at 4 peak frequencies. Without the cut
/// the literature's 0.834 and 0.777 (JONSWAP), 0.772 and 0.710 (Pierson-Moskowitz). By SciPy:
///
/// ```text
/// from math import *; from scipy.integrate import quad
/// for gamma in 3.3, 1:
///     S = lambda x: x**-5*exp(-1.25*x**-4)*gamma**exp(-(x - 1)**2/2/(0.07 if x <= 1 else 0.09)**2)
///     m = [sum(quad(lambda x: x**n*S(x), a, b)[0] for a, b in ((.35, .8), (.8, 1), (1, 1.3), (1.3, 4))) for n in range(3)]
///     print(m[0]/m[1], sqrt(m[0]/m[2]))
/// ```
#[test]
fn moments_are_those_of_the_spectrum() {
    let peak = TAU / 5.0;
    for (spectrum, mean_period, crossing_period) in [
        (SEA, 0.843_658_226, 0.801_321_653),
        (DEVELOPED, 0.783_730_887, 0.738_293_182),
    ] {
        let (mean, deviation) = mean_of_seeds(spectrum, |sea| peak / mean_power(sea, 1));
        assert!((mean / mean_period - 1.0).abs() < 1e-3, "{mean}");

        assert!(deviation < 6e-3, "{deviation}");
        let (mean, deviation) = mean_of_seeds(spectrum, |sea| peak / mean_power(sea, 2).sqrt());
        assert!((mean / crossing_period - 1.0).abs() < 2e-3, "{mean}");

        assert!(deviation < 1.3e-2, "{deviation}");
    }
}

/// Energy below the peak: exp(-5/4) of Pierson's and Moskowitz's whole, of which 0.9951 is below the cut; by SciPy as above
/// for the other.
#[test]
fn the_peak_is_where_it_was_asked() {
    let below = |spectrum: Spectrum| {
        let field = sea(Spectrum {
            components: 1000,
            ..spectrum
        });
        let peak = TAU / 5.0;
        let waves = field.components().iter();
        waves.filter(|wave| wave.frequency < peak).count() as f64 / 1000.0
    };
    assert!((below(DEVELOPED) - (-1.25_f64).exp() / 0.995_129).abs() <= 1e-3);
    assert!((below(SEA) - 0.339_512_930).abs() <= 1e-3);
    // The densest twentieth of the components stands about the peak.
    let field = sea(Spectrum {
        components: 1000,
        ..SEA
    });
    let at = |index: usize| field.components()[index].frequency * 5.0 / TAU;
    let densest = (0..950).min_by(|&a, &b| (at(a + 50) - at(a)).total_cmp(&(at(b + 50) - at(b))));
    let densest = densest.expect("there are many");
    let middle = 0.5 * (at(densest) + at(densest + 50));
    assert!((middle - 1.0).abs() < 0.03, "{middle}");
    let peak = field.peak();
    assert_eq!((peak.height, peak.period, peak.direction), (0.5, 5.0, 0.4));
    assert!((peak.length - GRAVITY * 25.0 / TAU).abs() < 1e-12);
}

/// First moment of cos^2s(angle / 2): s / (s + 1) along the mean direction, 0 across it.
#[test]
fn directions_spread_as_asked() {
    for exponent in [0.0, 1.0, 10.0, 75.0, 1000.0] {
        let field = sea(Spectrum {
            spreading: Some(exponent),
            ..SEA
        });
        let [mut along, mut across] = [0.0; 2];
        for wave in field.components() {
            let angle = wave.wavenumber[1].atan2(wave.wavenumber[0]) - 0.4;
            along += angle.cos() / 60.0;
            across += angle.sin() / 60.0;
        }
        assert!(
            (along - exponent / (exponent + 1.0)).abs() < 0.02,
            "{exponent}: {along}"
        );
        assert!(across.abs() < 0.03, "{exponent}: {across}");
    }
    // Low and high frequencies spread alike.
    let field = sea(Spectrum {
        spreading: Some(10.0),
        components: 120,
        ..SEA
    });
    for waves in field.components().chunks(30) {
        let mean = waves
            .iter()
            .map(|wave| (wave.wavenumber[1].atan2(wave.wavenumber[0]) - 0.4).cos() / 30.0);
        assert!((mean.sum::<f64>() - 10.0 / 11.0).abs() < 0.03);
    }
    for wave in sea(SEA).components() {
        let angle = wave.wavenumber[1].atan2(wave.wavenumber[0]);
        assert!((angle - 0.4).abs() < 1e-14);
    }
}

#[test]
fn a_spectrum_in_shallow_water_has_its_frequencies_and_shorter_waves() {
    let deep = sea(SEA);
    let (shallow, _) = WaveField::from_spectrum(&SEA, Some(3.0), GRAVITY).expect("a sea");
    for (a, b) in deep.components().iter().zip(shallow.components()) {
        assert_eq!((a.frequency, a.phase), (b.frequency, b.phase));
        assert!(b.wavenumber_norm() >= a.wavenumber_norm());
    }
    assert!(shallow.shortest_length() <= shallow.peak().length);
}

#[test]
fn a_seed_gives_one_sea() {
    assert_eq!(sea(SEA), sea(SEA));
    let text = r#"{"schema": "hydro-waves/1", "spectrum": "jonswap", "significant_height": 0.5, "peak_period": 5,
                   "direction": 22.918311805232928, "seed": 1}"#;
    let read = read(text);
    for (a, b) in read.components().iter().zip(sea(SEA).components()) {
        assert_eq!((a.frequency, a.phase), (b.frequency, b.phase));
    }
    let other = sea(Spectrum { seed: 2, ..SEA });
    for (a, b) in sea(SEA).components().iter().zip(other.components()) {
        assert!(a.frequency != b.frequency && a.phase != b.phase);
    }
}

/// NumPy and SciPy: NumPy's Philox counts before it draws, hence the counter less one. The second pair is in water of 3 m.
///
/// ```text
/// import numpy as np; from math import *; from scipy.integrate import quad; from scipy.optimize import brentq
/// K = lambda w, d: brentq(lambda k: 9.81*k*tanh(k*d) - w*w, 1e-6, 1e3, xtol=1e-15)*d
/// P = lambda k: tanh(k)**2/(1 + 2*k/sinh(2*k))
/// J = lambda x: x**-5*exp(-1.25*x**-4)*3.3**exp(-(x - 1)**2/2/(0.07 if x <= 1 else 0.09)**2)
/// L = lambda x, o=2: x**-4*exp(-1.25*x**-4 - o*(x - 1)/10**.5)*(1.7 + 6*log10(o))**exp(-(x - 1)**2/2/(.08*(1 + 4*o**-3))**2)
/// E = lambda S, b: sum(quad(S, l, min(b, h), epsabs=1e-13)[0] for l, h in ((.35, .8), (.8, 1), (1, 1.3), (1.3, 4)) if b > l)
/// for S in J, lambda x: P(K(2*pi/5*x, 3))*J(x), L:
///     for i in 30, 59:
///         raw = np.random.Philox(counter=[i - 1, 0, 0, 0], key=[1, 1]).random_raw(4)
///         u = ((raw >> np.uint64(12)).astype(float) + 0.5)*2.0**-52
///         print(2*pi/5*brentq(lambda x: E(S, x) - (i + u[0])/60*E(S, 4), .35, 4, xtol=1e-14), 2*pi*u[1])
/// ```
#[test]
fn components_as_computed_independently() {
    let shallow = Spectrum {
        shape: SpectrumShape::Tma {
            peak_enhancement: 3.3,
        },
        ..SEA
    };
    let (shallow, _) = WaveField::from_spectrum(&shallow, Some(3.0), GRAVITY).expect("a sea");
    let young = sea(Spectrum {
        shape: SpectrumShape::Eckv {
            inverse_wave_age: 2.0,
        },
        ..SEA
    });
    let phases = [3.798_378_523_687_586_7, 1.020_803_071_970_471_5];
    for (field, frequencies) in [
        (sea(SEA), [1.328_176_292_239_301_4, 3.577_914_238_648_878]),
        (shallow, [1.510_117_948_947_675_3, 4.240_142_219_666_481]),
        (young, [1.3257971703425493, 3.3244801280703724]),
    ] {
        for ((index, frequency), phase) in [30, 59].into_iter().zip(frequencies).zip(phases) {
            let wave = field.components()[index];
            let error = wave.frequency / frequency - 1.0;
            assert!(error.abs() < 1e-6, "{}", wave.frequency);
            assert!((wave.phase - phase).abs() < 1e-14, "{}", wave.phase);
        }
    }
}

/// In water as deep as the waves are long the bottom takes nothing.
#[test]
fn in_deep_water_the_spectrum_of_a_finite_depth_is_the_other() {
    let at = |shape, depth| {
        let sea = Spectrum { shape, ..SEA };
        let (sea, _) = WaveField::from_spectrum(&sea, Some(depth), GRAVITY).expect("a sea");
        let waves = sea.components().iter();
        waves.map(|wave| wave.frequency).collect::<Vec<f64>>()
    };
    let peak_enhancement = 3.3;
    let tma = SpectrumShape::Tma { peak_enhancement };
    for (depth, most) in [(2000.0, 1e-14), (40.0, 2e-3)] {
        for (a, b) in at(tma, depth).iter().zip(at(SEA.shape, depth)) {
            assert!((a / b - 1.0).abs() < most, "{depth} m: {a} {b}");
        }
    }
    let deep = WaveField::from_spectrum(&Spectrum { shape: tma, ..SEA }, None, GRAVITY);
    assert_eq!(
        deep.expect_err("no depth").to_string(),
        "depth: found none, expected the depth of the water [m], on which `tma` depends"
    );
}

/// Random bits must never change, nor the numbers that are made of them: `python -c "import numpy as np;
/// print([hex(x) for x in np.random.Philox(counter=[2, 0, 0, 0], key=[1, 2]).random_raw(4)])"`. The words of key and counter
/// 0 are those of Random123's known answers.
#[test]
fn random_numbers_are_fixed_forever() {
    assert_eq!(
        random::words(1, 2, 3),
        [
            0xa348_4cee_f337_6fef,
            0x8637_5ea3_c1a8_7429,
            0x6f1e_ba45_8e6a_5d4c,
            0x05a5_abfb_5d85_891d
        ]
    );
    assert_eq!(
        random::words(0, 0, 0),
        [
            0x1655_4d9e_ca36_314c,
            0xdb20_fe9d_672d_0fdc,
            0xd7e7_72ce_e186_176b,
            0x7e68_b68a_ec7b_a23b
        ]
    );
    // NumPy: r = np.sqrt(-2*np.log(u[0])); r*np.cos(2*pi*u[1]), r*np.sin(2*pi*u[1]), and so from u[2], u[3].
    let numpy = [
        -0.937_346_376_612_832,
        -0.144_131_648_833_912_44,
        1.279_559_624_963_834_4,
        0.178_494_039_734_403_14,
    ];
    for (found, expected) in random::normal(1, 2, 3).into_iter().zip(numpy) {
        assert!((found - expected).abs() < 2e-15, "{found}");
    }
    assert_eq!(
        random::normal(1, 2, 3).map(f64::to_bits),
        [
            13829990121984913493,
            13817732947065156859,
            4608441443422832368,
            4595598945817221124
        ]
    );
    let wave = sea(Spectrum {
        spreading: Some(10.0),
        ..SEA
    })
    .components()[30];
    assert_eq!(
        [
            wave.frequency,
            wave.wavenumber[0],
            wave.wavenumber[1],
            wave.phase
        ]
        .map(f64::to_bits),
        [
            4608660395191429332,
            4595614403740763072,
            4580833047863765281,
            4615735606851963163
        ]
    );
}

#[test]
fn random_numbers_are_uniform_and_normal() {
    let (mut sums, mut powers) = ([0.0; 2], [0.0; 4]);
    let count = 50_000_u32;
    for counter in 0..count {
        for number in random::uniform(7, random::WAVES, u64::from(counter)) {
            assert!(number > 0.0 && number < 1.0);
            sums[0] += number;
            sums[1] += number * number;
        }
        for number in random::normal(7, random::CURRENT, u64::from(counter)) {
            for (power, sum) in (1..).zip(&mut powers) {
                *sum += number.powi(power);
            }
        }
    }
    let all = 4.0 * f64::from(count);
    assert!((sums[0] / all - 0.5).abs() < 0.003 && (sums[1] / all - 1.0 / 3.0).abs() < 0.003);
    let [mean, square, cube, fourth] = powers.map(|sum| sum / all);
    assert!(mean.abs() < 0.01 && (square - 1.0).abs() < 0.015);
    assert!(
        cube.abs() < 0.03 && (fourth - 3.0).abs() < 0.1,
        "{cube} {fourth}"
    );
}
