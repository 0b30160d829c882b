//! Unit of an expression, and the interval that holds its value whatever its inputs within their bounds.
//!
//! Interval arithmetic encloses and does not estimate: an expression that passes is finite wherever its inputs may go, and
//! one that fails may be refused although its true values are finite.

use super::{
    error::OwnError,
    expression::{Binary, Expression, Kind, Node, Unary},
    units::Dimension,
};

/// An interval, both ends belonging to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Range {
    pub(crate) lower: f64,
    pub(crate) upper: f64,
}

impl Range {
    pub(crate) fn new(lower: f64, upper: f64) -> Self {
        Self { lower, upper }
    }

    pub(crate) fn point(value: f64) -> Self {
        Self::new(value, value)
    }

    /// The interval that holds several numbers.
    fn around(values: impl IntoIterator<Item = f64>) -> Self {
        let start = Self::new(f64::INFINITY, f64::NEG_INFINITY);
        values.into_iter().fold(start, |range, value| {
            // A number that is none leaves no interval.
            if value.is_nan() {
                Self::new(f64::NAN, f64::NAN)
            } else {
                Self::new(range.lower.min(value), range.upper.max(value))
            }
        })
    }

    /// The least interval with this one and a value.
    pub(crate) fn with(self, value: f64) -> Self {
        Self::new(self.lower.min(value), self.upper.max(value))
    }

    pub(crate) fn holds(self, value: f64) -> bool {
        self.lower <= value && value <= self.upper
    }

    pub(crate) fn is_zero(self) -> bool {
        self.lower == 0.0 && self.upper == 0.0
    }

    fn is_finite(self) -> bool {
        self.lower.is_finite() && self.upper.is_finite()
    }

    fn map(self, f: impl Fn(f64) -> f64) -> Self {
        Self::around([f(self.lower), f(self.upper)])
    }

    fn corners(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        Self::around([
            f(self.lower, other.lower),
            f(self.lower, other.upper),
            f(self.upper, other.lower),
            f(self.upper, other.upper),
        ])
    }

    fn powi(self, power: i32) -> Self {
        let ends = self.map(|value| value.powi(power));
        if power != 0 && power % 2 == 0 && self.holds(0.0) {
            ends.with(0.0)
        } else {
            ends
        }
    }
}

/// Unit and interval of a quantity. Zero, written as a number, has every unit: `None`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Facts {
    pub(crate) dimension: Option<Dimension>,
    pub(crate) range: Range,
}

/// Source of unit and interval of the quantities that expressions name, found when they are asked for.
pub(crate) trait Known {
    /// Unit and interval of a quantity from outside.
    fn input(&mut self, at: usize) -> Result<Facts, OwnError>;

    /// Unit and interval of a named intermediate.
    fn local(&mut self, at: usize) -> Result<Facts, OwnError>;
}

/// Unit and interval of an expression.
pub(crate) fn facts(of: &Expression, known: &mut dyn Known) -> Result<Facts, OwnError> {
    Check { of, known }.node(&of.root)
}

struct Check<'a> {
    of: &'a Expression,
    known: &'a mut dyn Known,
}

impl Check<'_> {
    fn node(&mut self, node: &Node) -> Result<Facts, OwnError> {
        let facts = match &node.kind {
            Kind::Number(value) => Facts {
                dimension: (*value != 0.0).then_some(Dimension::NUMBER),
                range: Range::point(*value),
            },
            Kind::Input(at) => self.known.input(*at)?,
            Kind::Local(at) => self.known.local(*at)?,
            Kind::Unary(function, a) => self.unary(*function, a)?,
            Kind::Whole(a, power) => self.whole(a, *power)?,
            Kind::Binary(function, a, b) => self.binary(*function, a, b)?,
        };
        if facts.range.is_finite() {
            return Ok(facts);
        }
        Err(OwnError::Unbounded {
            place: self.of.place.clone(),
            part: self.of.part(node),
        })
    }

    fn dimension_fault(&self, node: &Node, found: Dimension, expected: Dimension) -> OwnError {
        OwnError::Dimension {
            place: self.of.place.clone(),
            part: self.of.part(node),
            found: found.to_string(),
            expected: expected.to_string(),
        }
    }

    /// A power of a unit that is no unit.
    fn no_unit(&self, node: &Node) -> OwnError {
        OwnError::Unit {
            place: self.of.place.clone(),
            found: self.of.part(node),
            what: "its unit has no meaning; divide by a reference value first".to_owned(),
        }
    }

    fn undefined(
        &self,
        function: &'static str,
        node: &Node,
        needs: &'static str,
        range: Range,
    ) -> OwnError {
        OwnError::Undefined {
            place: self.of.place.clone(),
            function,
            part: self.of.part(node),
            needs,
            lower: range.lower,
            upper: range.upper,
        }
    }

    /// A divisor that keeps away from zero.
    fn divides(&self, node: &Node, range: Range) -> Result<(), OwnError> {
        if !range.holds(0.0) {
            return Ok(());
        }
        Err(OwnError::Division {
            place: self.of.place.clone(),
            part: self.of.part(node),
            lower: range.lower,
            upper: range.upper,
        })
    }

    fn unary(&mut self, function: Unary, a: &Node) -> Result<Facts, OwnError> {
        let Facts { dimension, range } = self.node(a)?;
        let pure = |facts: Range| -> Result<Facts, OwnError> {
            match dimension {
                Some(found) if found != Dimension::NUMBER => {
                    Err(self.dimension_fault(a, found, Dimension::NUMBER))
                }
                _ => Ok(Facts {
                    dimension: Some(Dimension::NUMBER),
                    range: facts,
                }),
            }
        };
        let number = |range: Range| Facts {
            dimension: Some(Dimension::NUMBER),
            range,
        };
        let whole_turn = |f: fn(f64) -> f64| {
            if range.lower == range.upper {
                Range::point(f(range.lower))
            } else {
                Range::new(-1.0, 1.0)
            }
        };
        match function {
            Unary::Minus => Ok(Facts {
                dimension,
                range: range.map(|value| -value),
            }),
            Unary::Abs => {
                let ends = range.map(f64::abs);
                let range = if range.holds(0.0) {
                    ends.with(0.0)
                } else {
                    ends
                };
                Ok(Facts { dimension, range })
            }
            Unary::Sign => {
                let sign = |value: f64| if value == 0.0 { 0.0 } else { value.signum() };
                Ok(number(range.map(sign)))
            }
            Unary::Step => Ok(number(range.map(|value| f64::from(u8::from(value > 0.0))))),
            Unary::Sqrt => {
                if range.lower < 0.0 {
                    return Err(self.undefined(
                        "sqrt",
                        a,
                        "a number that is never negative",
                        range,
                    ));
                }
                let dimension = match dimension {
                    Some(of) => Some(of.sqrt().ok_or_else(|| self.no_unit(a))?),
                    None => None,
                };
                Ok(Facts {
                    dimension,
                    range: range.map(f64::sqrt),
                })
            }
            Unary::Ln => {
                if range.lower <= 0.0 {
                    return Err(self.undefined("ln", a, "a number above zero", range));
                }
                pure(range.map(f64::ln))
            }
            Unary::Exp => pure(range.map(f64::exp)),
            Unary::Sin => pure(whole_turn(f64::sin)),
            Unary::Cos => pure(whole_turn(f64::cos)),
            Unary::Tanh => pure(range.map(f64::tanh)),
            Unary::Atan => pure(range.map(f64::atan)),
        }
    }

    fn whole(&mut self, a: &Node, power: i32) -> Result<Facts, OwnError> {
        let Facts { dimension, range } = self.node(a)?;
        if power < 0 {
            self.divides(a, range)?;
        }
        let dimension = match dimension {
            Some(of) => Some(of.powi(power).ok_or_else(|| self.no_unit(a))?),
            // 0^0 is the number 1.
            None if power == 0 => Some(Dimension::NUMBER),
            None => None,
        };
        Ok(Facts {
            dimension,
            range: range.powi(power),
        })
    }

    fn binary(&mut self, function: Binary, a: &Node, b: &Node) -> Result<Facts, OwnError> {
        let (first, second) = (self.node(a)?, self.node(b)?);
        let (x, y) = (first.range, second.range);
        let product = |times: fn(Dimension, Dimension) -> Option<Dimension>| {
            let (Some(one), Some(other)) = (first.dimension, second.dimension) else {
                return Ok(None);
            };
            times(one, other).map(Some).ok_or_else(|| self.no_unit(b))
        };
        let alike = || match (first.dimension, second.dimension) {
            (Some(one), Some(other)) if one != other => Err(self.dimension_fault(b, other, one)),
            (one, other) => Ok(one.or(other)),
        };
        let (dimension, range) = match function {
            Binary::Add => (alike()?, Range::new(x.lower + y.lower, x.upper + y.upper)),
            Binary::Subtract => (alike()?, Range::new(x.lower - y.upper, x.upper - y.lower)),
            Binary::Min => (
                alike()?,
                Range::new(x.lower.min(y.lower), x.upper.min(y.upper)),
            ),
            Binary::Max => (
                alike()?,
                Range::new(x.lower.max(y.lower), x.upper.max(y.upper)),
            ),
            // The same thing twice is a square.
            Binary::Multiply if a.is_same(b) => (product(Dimension::times)?, x.powi(2)),
            Binary::Multiply => (product(Dimension::times)?, x.corners(y, |x, y| x * y)),
            Binary::Divide => {
                self.divides(b, y)?;
                (product(Dimension::over)?, x.corners(y, |x, y| x / y))
            }
            Binary::Power => {
                for (part, facts) in [(a, first), (b, second)] {
                    if let Some(found) = facts.dimension.filter(|of| *of != Dimension::NUMBER) {
                        return Err(self.dimension_fault(part, found, Dimension::NUMBER));
                    }
                }
                if x.lower < 0.0 {
                    let needs = "a number that is never negative";
                    return Err(self.undefined("a broken power", a, needs, x));
                }
                if y.lower <= 0.0 {
                    self.divides(a, x)?;
                }
                (Some(Dimension::NUMBER), x.corners(y, f64::powf))
            }
        };
        Ok(Facts { dimension, range })
    }
}
