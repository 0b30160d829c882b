//! Units of the user's quantities: text to powers of kilogram, metre and second. Angles are pure numbers.

/// Powers of a base unit are kept in twelfths, so that square roots stay whole.
const WHOLE: i16 = 12;
/// Greatest power of a base unit.
const MOST: i16 = 12 * WHOLE;

/// Powers of kilogram, metre and second, in twelfths.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Dimension([i16; 3]);

/// Every known unit.
const NAMES: [(&str, [i16; 3]); 10] = [
    ("1", [0, 0, 0]),
    ("rad", [0, 0, 0]),
    ("kg", [1, 0, 0]),
    ("m", [0, 1, 0]),
    ("s", [0, 0, 1]),
    ("N", [1, 1, -2]),
    ("Pa", [1, -1, -2]),
    ("J", [1, 2, -2]),
    ("W", [1, 2, -3]),
    ("Hz", [0, 0, -1]),
];

/// Dimensions with a name of their own in messages.
const SPOKEN: [(&str, [i16; 3]); 16] = [
    ("1", [0, 0, 0]),
    ("m", [0, 1, 0]),
    ("s", [0, 0, 1]),
    ("kg", [1, 0, 0]),
    ("1/s", [0, 0, -1]),
    ("1/m", [0, -1, 0]),
    ("m/s", [0, 1, -1]),
    ("m^2/s^2", [0, 2, -2]),
    ("m/s^2", [0, 1, -2]),
    ("N", [1, 1, -2]),
    ("N m", [1, 2, -2]),
    ("N/m", [1, 0, -2]),
    ("N s/m", [1, 0, -1]),
    ("N s^2/m^2", [1, -1, 0]),
    ("N m s", [1, 2, -1]),
    ("kg m^2", [1, 2, 0]),
];

impl Dimension {
    pub(crate) const NUMBER: Self = Self([0; 3]);
    pub(crate) const METRE: Self = Self([0, WHOLE, 0]);
    pub(crate) const SECOND: Self = Self([0, 0, WHOLE]);
    pub(crate) const SPEED: Self = Self([0, WHOLE, -WHOLE]);
    pub(crate) const RATE: Self = Self([0, 0, -WHOLE]);
    pub(crate) const DENSITY: Self = Self([WHOLE, -3 * WHOLE, 0]);
    pub(crate) const FORCE: Self = Self([WHOLE, WHOLE, -2 * WHOLE]);
    pub(crate) const TORQUE: Self = Self([WHOLE, 2 * WHOLE, -2 * WHOLE]);
    pub(crate) const MASS: Self = Self([WHOLE, 0, 0]);
    pub(crate) const INERTIA: Self = Self([WHOLE, 2 * WHOLE, 0]);

    /// `N s^2/m^2`, `1/s`, `kg m^2`: factors divided by spaces or `*`; a `/` divides by the one factor after it.
    pub(crate) fn parse(text: &str) -> Result<Self, String> {
        let mut sum = Self::NUMBER;
        let mut rest = text.trim();
        if rest.is_empty() {
            return Err("empty; write 1 for a number without a unit".to_owned());
        }
        let mut sign = 1;
        loop {
            let end = rest.find([' ', '*', '/']).unwrap_or(rest.len());
            let (factor, after) = rest.split_at(end);
            let (name, power) = factor.split_once('^').unwrap_or((factor, "1"));
            let power: i16 = power
                .parse()
                .ok()
                .filter(|power| (-9..=9).contains(power))
                .ok_or_else(|| format!("`{factor}`: a power is a whole number from -9 to 9"))?;
            let (_, base) = NAMES
                .iter()
                .find(|(known, _)| *known == name)
                .ok_or_else(|| unknown(name))?;
            let factor = Self(base.map(|of| of * power * sign * WHOLE));
            sum = sum
                .times(factor)
                .ok_or_else(|| "powers that high have no meaning".to_owned())?;
            let after = after.trim_start();
            let divided = after.starts_with('/');
            rest = after.trim_start_matches(['/', '*']).trim_start();
            if after.is_empty() {
                return Ok(sum);
            }
            if rest.is_empty() {
                return Err("nothing follows the last sign".to_owned());
            }
            sign = if divided { -1 } else { 1 };
        }
    }

    fn within(powers: [i32; 3]) -> Option<Self> {
        let mut kept = [0; 3];
        for (kept, power) in kept.iter_mut().zip(powers) {
            *kept = i16::try_from(power)
                .ok()
                .filter(|power| power.abs() <= MOST)?;
        }
        Some(Self(kept))
    }

    /// Of a product; `None` where a power is absurd.
    pub(crate) fn times(self, other: Self) -> Option<Self> {
        Self::within(std::array::from_fn(|base| {
            i32::from(self.0[base]) + i32::from(other.0[base])
        }))
    }

    /// Of a quotient.
    pub(crate) fn over(self, other: Self) -> Option<Self> {
        self.times(Self(other.0.map(|power| -power)))
    }

    /// Of a whole power.
    pub(crate) fn powi(self, power: i32) -> Option<Self> {
        Self::within(self.0.map(|of| i32::from(of).saturating_mul(power)))
    }

    /// Of a square root; `None` where a power would be no twelfth.
    pub(crate) fn sqrt(self) -> Option<Self> {
        (self.0.iter().all(|power| power % 2 == 0)).then(|| Self(self.0.map(|power| power / 2)))
    }
}

fn unknown(name: &str) -> String {
    let repair = match name {
        "deg" | "degree" | "degrees" => "angles are in rad",
        "mm" | "cm" | "km" | "ft" | "in" => "lengths are in m",
        "g" | "t" | "lb" => "masses are in kg",
        "ms" | "min" | "h" => "times are in s",
        "kN" | "mN" | "lbf" => "forces are in N",
        "Nm" => "write `N m`",
        _ => "units are made of N, m, kg, s, rad, Pa, J, W, Hz and 1",
    };
    format!("`{name}` is not known; {repair}")
}

impl std::fmt::Display for Dimension {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let spoken = SPOKEN
            .iter()
            .find(|(_, of)| of.map(|power| power * WHOLE) == self.0);
        if let Some((name, _)) = spoken {
            return f.write_str(name);
        }
        let factors: Vec<String> = ["kg", "m", "s"]
            .iter()
            .zip(self.0)
            .filter(|(_, power)| *power != 0)
            .map(|(name, power)| match f64::from(power) / f64::from(WHOLE) {
                1.0 => (*name).to_owned(),
                power => format!("{name}^{power}"),
            })
            .collect();
        f.write_str(&factors.join(" "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_read_and_said() {
        let read = |text: &str| Dimension::parse(text).map(|of| of.to_string());
        for (text, said) in [
            ("N", "N"),
            ("N s^2/m^2", "N s^2/m^2"),
            ("kg/m", "N s^2/m^2"),
            ("N m s/rad", "N m s"),
            ("1/s", "1/s"),
            ("Hz", "1/s"),
            ("m*s^-1", "m/s"),
            ("kg m/s^2", "N"),
            ("kg m^4", "kg m^4"),
            (" J ", "N m"),
        ] {
            assert_eq!(read(text), Ok(said.to_owned()), "{text}");
        }
        for (text, fault) in [
            ("deg", "angles are in rad"),
            ("Nm", "write `N m`"),
            ("N/", "nothing follows"),
            ("m^x", "a power is a whole number"),
            ("m^99", "a power is a whole number"),
            ("", "write 1"),
            ("m^9 m^9", "powers that high"),
            ("knots", "`knots` is not known"),
        ] {
            let found = read(text).expect_err(text);
            assert!(found.contains(fault), "{text}: {found}");
        }
    }

    #[test]
    fn roots_keep_whole_twelfths() {
        let area = Dimension::METRE.powi(2).expect("an area");
        assert_eq!(area.sqrt(), Some(Dimension::METRE));
        assert_eq!(
            Dimension::METRE.sqrt().map(|of| of.to_string()),
            Some("m^0.5".to_owned())
        );
        let mut root = Dimension::METRE;
        for _ in 0..2 {
            root = root.sqrt().expect("twelfths");
        }
        assert_eq!(root.sqrt(), None);
        assert_eq!(Dimension::METRE.powi(i32::MAX), None);
    }
}
