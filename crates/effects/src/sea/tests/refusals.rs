//! Every refusal of waves names what was found, where, and what was expected.

use super::GRAVITY;
use crate::sea::{SeaError, Spectrum, SpectrumShape, Wave, WaveField};

fn fault(text: &str) -> String {
    WaveField::parse(text, GRAVITY)
        .expect_err("it should be refused")
        .to_string()
}

/// The fault of a file with these fields beside its schema.
fn with(fields: &str) -> String {
    fault(&format!(r#"{{"schema": "hydro-waves/1", {fields}}}"#))
}

/// The fault of one listed wave.
fn wave(fields: &str) -> String {
    with(&format!(
        r#""components": [{{"height": 0.1, "period": 2}}, {{{fields}}}]"#
    ))
}

/// The fault of a spectrum with fields that replace or add.
fn spectrum(fields: &[(&str, &str)]) -> String {
    let mut all = vec![
        ("spectrum", "\"jonswap\""),
        ("significant_height", "0.5"),
        ("peak_period", "5"),
    ];
    for &(key, value) in fields {
        all.retain(|&(other, _)| other != key);
        if !value.is_empty() {
            all.push((key, value));
        }
    }
    let all: Vec<String> = all
        .iter()
        .map(|(key, value)| format!("\"{key}\": {value}"))
        .collect();
    with(&all.join(", "))
}

#[test]
fn what_is_no_such_file() {
    assert!(fault("{").starts_with("not JSON, line 1"));
    assert!(fault("").starts_with("not JSON"));
    assert!(
        fault("[]")
            .contains("found a list of 0, expected an object with `schema`: `hydro-waves/1`")
    );
    assert_eq!(
        fault(r#"{"schema": "hydro-effects/1"}"#),
        "`schema`: found the string `hydro-effects/1`, expected `hydro-waves/1`"
    );
    assert_eq!(
        fault("{}"),
        "`schema`: found none, expected `hydro-waves/1`"
    );
    assert!(fault(r#"{"schema": 1}"#).contains("found the number 1"));
    assert_eq!(
        fault(r#"{"schema": "hydro-waves/1"}"#),
        "the file: no `spectrum`, expected a spectrum, `jonswap`, `tma`, `eckv` or `pierson_moskowitz`, or a list `components`"
    );
    assert!(with("\"components\": 60").contains("no `spectrum`"));
    assert!(with("\"significant_height\": 1").contains("no `spectrum`"));
}

#[test]
fn unknown_keys() {
    assert_eq!(
        with(r#""component": []"#),
        "the file: there is no `component`; did you mean `components`?; there are: schema, depth, spectrum, \
         significant_height, peak_period, direction, spreading, peak_enhancement, inverse_wave_age, components, seed"
    );
    assert_eq!(
        with(r#""components": [], "dept": 3"#),
        "the file: there is no `dept`; did you mean `depth`?; there are: schema, depth, components"
    );
    assert_eq!(
        wave(r#""heigth": 0.1, "period": 2"#),
        "components[1]: there is no `heigth`; did you mean `height`?; there are: height, amplitude, period, direction, phase"
    );
    assert!(spectrum(&[("gamma", "3")]).contains("there is no `gamma`; there are: "));
    assert!(
        spectrum(&[("significant_heigth", "3")]).contains("did you mean `significant_height`?")
    );
}

#[test]
fn listed_waves() {
    assert!(
        with(r#""components": []"#)
            .contains("components: found a list of 0, expected a list of 1 to 1000 waves")
    );
    let many = vec![r#"{"height": 0.1, "period": 2}"#; 1001].join(",");
    assert!(with(&format!(r#""components": [{many}]"#)).contains("found a list of 1001"));
    assert!(
        with(r#""components": [3]"#)
            .contains("components[0]: found the number 3, expected an object")
    );
    assert_eq!(
        wave(r#""period": 2"#),
        "components[1]: no `height`, expected `height` or `amplitude`"
    );
    assert_eq!(
        wave(r#""height": 1, "amplitude": 0.5, "period": 2"#),
        "components[1]: found both `height` and `amplitude`, expected one of them"
    );
    assert_eq!(
        wave(r#""height": 0.1"#),
        "components[1]: no `period`, expected a number [s]"
    );
    for period in ["0", "-3", "1e300", "1e-300"] {
        let text = wave(&format!(r#""height": 0.1, "period": {period}"#));
        assert!(text.starts_with("components[1].period: found "), "{text}");
        assert!(text.ends_with(" s, expected 0.01 to 10000 s"), "{text}");
    }
    assert_eq!(
        wave(r#""height": -0.1, "period": 2"#),
        "components[1].height: found -0.1 m, expected 0 to 200 m"
    );
    assert_eq!(
        wave(r#""amplitude": 101, "period": 200"#),
        "components[1].amplitude: found 101 m, expected 0 to 100 m"
    );
    assert_eq!(
        wave(r#""amplitude": "1", "period": 2"#),
        "components[1].amplitude: found the string `1`, expected a number [m]"
    );
    assert!(wave(r#""height": 0.1, "period": null"#).contains("found null"));
    assert!(
        wave(r#""height": 0.1, "period": 2, "direction": [1]"#)
            .contains("direction: found a list of 1")
    );
    assert!(
        wave(r#""height": 0.1, "period": 2, "phase": true"#)
            .contains("phase: found true, expected a number [degrees]")
    );
    assert!(wave(r#""height": NaN, "period": 2"#).starts_with("not JSON"));
    assert!(wave(r#""height": 1e999, "period": 2"#).starts_with("not JSON"));
}

#[test]
fn depths() {
    for depth in ["0", "-2", "1e9"] {
        let text = with(&format!(
            r#""depth": {depth}, "components": [{{"height": 0.1, "period": 2}}]"#
        ));
        assert!(
            text.starts_with("depth: found ") && text.ends_with("expected 0.001 to 20000 m"),
            "{text}"
        );
        assert!(spectrum(&[("depth", depth)]).starts_with("depth: found "));
    }
    assert!(
        spectrum(&[("depth", "\"deep\"")])
            .contains("found the string `deep`, expected a number [m]")
    );
}

#[test]
fn breaking_waves() {
    // 2 s in deep water: 6.245 m long, 0.892 m high at most.
    assert!(
        WaveField::parse(
            r#"{"schema": "hydro-waves/1", "components": [{"height": 0.89, "period": 2}]}"#,
            GRAVITY
        )
        .is_ok()
    );
    assert_eq!(
        wave(r#""height": 1, "period": 2"#),
        "components[1]: a height of 1.0000 m on a length of 6.2452 m is a steepness of 0.1601, expected at most 0.1429, where \
         waves break (a seventh in deep water); lower the height or lengthen the period"
    );
    let text = with(r#""depth": 1, "components": [{"height": 0.95, "period": 20}]"#);
    assert!(
        text.contains("steepness of 0.0152, expected at most 0.0143"),
        "{text}"
    );
    let text = spectrum(&[("significant_height", "6")]);
    assert!(
        text.starts_with("significant_height: a height of 6.0000 m on a length of 39.03"),
        "{text}"
    );
}

#[test]
fn spectra() {
    assert_eq!(
        spectrum(&[("peak_period", "")]),
        "the file: no `peak_period`, expected a number [s]"
    );
    assert_eq!(
        spectrum(&[("significant_height", "")]),
        "the file: no `significant_height`, expected a number [m]"
    );
    assert_eq!(
        spectrum(&[("spectrum", "\"johnswap\"")]),
        "`spectrum`: there is no `johnswap`; did you mean `jonswap`?; there are: jonswap, tma, eckv, pierson_moskowitz"
    );
    assert!(spectrum(&[("spectrum", "3")]).contains(
        "spectrum: found the number 3, expected `jonswap`, `tma`, `eckv` or `pierson_moskowitz`"
    ));
    assert_eq!(
        spectrum(&[
            ("spectrum", "\"pierson_moskowitz\""),
            ("peak_enhancement", "3.3")
        ]),
        "peak_enhancement: found it with `pierson_moskowitz`, expected it with `jonswap` or `tma` only"
    );
    assert_eq!(
        spectrum(&[("inverse_wave_age", "1")]),
        "inverse_wave_age: found it with `jonswap`, expected it with `eckv` only"
    );
    assert!(
        spectrum(&[("spectrum", "\"eckv\""), ("inverse_wave_age", "0.5")]).contains("0.84 to 5")
    );
    for (key, value, expected) in [
        ("significant_height", "-1", "0 to 100 m"),
        ("peak_period", "0", "0.01 to 10000 s"),
        ("peak_enhancement", "0.5", "1 to 10"),
        ("peak_enhancement", "20", "1 to 10"),
        ("spreading", "-1", "0 to 1000"),
        ("spreading", "1e4", "0 to 1000"),
        (
            "components",
            "19",
            "20 to 1000 components of a spectrum, or a list of waves",
        ),
        (
            "components",
            "1001",
            "20 to 1000 components of a spectrum, or a list of waves",
        ),
        (
            "components",
            "60.5",
            "a whole number of at least 0 and below 2^64",
        ),
        ("seed", "-1", "a whole number of at least 0 and below 2^64"),
        ("seed", "1.5", "a whole number of at least 0 and below 2^64"),
        ("direction", "\"north\"", "a number [degrees]"),
    ] {
        let text = spectrum(&[(key, value)]);
        assert!(text.starts_with(&format!("{key}: found ")), "{text}");
        assert!(text.ends_with(&format!("expected {expected}")), "{text}");
    }
    assert!(spectrum(&[("components", "[]")]).contains("components: found a list of 0"));
}

#[test]
fn gravity_that_makes_no_waves() {
    let text = r#"{"schema": "hydro-waves/1", "components": [{"height": 0.1, "period": 2}]}"#;
    for gravity in [0.0, -9.81, f64::NAN, f64::INFINITY] {
        let fault = WaveField::parse(text, gravity).expect_err("no waves");
        assert!(matches!(fault, SeaError::Gravity { .. }));
        assert!(fault.to_string().contains("expected a number above zero"));
    }
}

/// Values that JSON cannot hold come from code.
#[test]
fn numbers_that_are_none() {
    let fair = Wave {
        amplitude: 0.1,
        period: 2.0,
        direction: 0.0,
        phase: 0.0,
    };
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for (wave, field) in [
            (
                Wave {
                    amplitude: bad,
                    ..fair
                },
                "components[0].amplitude",
            ),
            (
                Wave {
                    period: bad,
                    ..fair
                },
                "components[0].period",
            ),
            (
                Wave {
                    direction: bad,
                    ..fair
                },
                "components[0].direction",
            ),
            (Wave { phase: bad, ..fair }, "components[0].phase"),
        ] {
            let text = WaveField::new(&[wave], None, GRAVITY)
                .expect_err("refused")
                .to_string();
            assert!(text.starts_with(&format!("{field}: found {bad}")), "{text}");
        }
        let text = WaveField::new(&[fair], Some(bad), GRAVITY)
            .expect_err("refused")
            .to_string();
        assert!(text.starts_with("depth: found "), "{text}");
        let fair = Spectrum {
            shape: SpectrumShape::PiersonMoskowitz,
            significant_height: 0.5,
            peak_period: 5.0,
            direction: 0.0,
            spreading: None,
            components: 60,
            seed: 0,
        };
        let jonswap = SpectrumShape::Jonswap {
            peak_enhancement: bad,
        };
        for (spectrum, field) in [
            (
                Spectrum {
                    shape: jonswap,
                    ..fair
                },
                "peak_enhancement",
            ),
            (
                Spectrum {
                    significant_height: bad,
                    ..fair
                },
                "significant_height",
            ),
            (
                Spectrum {
                    peak_period: bad,
                    ..fair
                },
                "peak_period",
            ),
            (
                Spectrum {
                    direction: bad,
                    ..fair
                },
                "direction",
            ),
            (
                Spectrum {
                    spreading: Some(bad),
                    ..fair
                },
                "spreading",
            ),
        ] {
            let text = WaveField::from_spectrum(&spectrum, None, GRAVITY)
                .expect_err("refused")
                .to_string();
            assert!(text.starts_with(&format!("{field}: found {bad}")), "{text}");
        }
    }
    let text = WaveField::new(&[], None, GRAVITY)
        .expect_err("refused")
        .to_string();
    assert_eq!(text, "components: found 0 waves, expected 1 to 1000");
    let many = vec![
        Wave {
            amplitude: 1e-6,
            ..fair
        };
        1001
    ];
    assert!(WaveField::new(&many, None, GRAVITY).is_err());
}
