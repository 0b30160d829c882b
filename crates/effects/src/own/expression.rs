//! Expressions: text to a syntax tree.
//!
//! ```text
//! sum     = product (("+" | "-") product)*
//! product = factor (("*" | "/") factor)*
//! factor  = "-" factor | power
//! power   = atom ("^" factor)?
//! atom    = number | name | function "(" sum ("," sum)* ")" | "(" sum ")"
//! ```

use super::error::OwnError;
use crate::did_you_mean::hint;

/// Most letters of an expression.
pub(crate) const LONGEST: usize = 1000;
/// Most parentheses, functions and signs within each other.
const NESTED: usize = 32;
/// Deepest tree: a sum of so many terms, too.
const DEEPEST: usize = 48;

/// A function of one number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Unary {
    Minus,
    Abs,
    /// -1, 0 or 1.
    Sign,
    /// 1 above zero, else 0.
    Step,
    Sqrt,
    Exp,
    Ln,
    Sin,
    Cos,
    Tanh,
    Atan,
}

/// A function of two numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Binary {
    Add,
    Subtract,
    Multiply,
    Divide,
    Power,
    Min,
    Max,
}

/// Functions of one number, by name.
const UNARY: [(&str, Unary); 10] = [
    ("abs", Unary::Abs),
    ("sign", Unary::Sign),
    ("step", Unary::Step),
    ("sqrt", Unary::Sqrt),
    ("exp", Unary::Exp),
    ("ln", Unary::Ln),
    ("sin", Unary::Sin),
    ("cos", Unary::Cos),
    ("tanh", Unary::Tanh),
    ("atan", Unary::Atan),
];

/// Functions of several, which are written out: `min`, `max`, `clamp(x, low, high)`, and `norm` of two or three.
const SEVERAL: [&str; 4] = ["min", "max", "clamp", "norm"];

/// Names of all functions.
pub(crate) fn functions<'a>() -> impl Iterator<Item = &'a str> {
    let names: [&'a str; 4] = SEVERAL;
    UNARY.iter().map(|(name, _)| *name).chain(names)
}

/// A part of an expression.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Kind {
    Number(f64),
    /// A quantity from outside, by its place.
    Input(usize),
    /// A named intermediate, by its place.
    Local(usize),
    Unary(Unary, Box<Node>),
    Binary(Binary, Box<Node>, Box<Node>),
    /// A whole power.
    Whole(Box<Node>, i32),
}

/// A part of an expression and where it stands in the text.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Node {
    pub(crate) kind: Kind,
    /// First byte, and one beyond the last.
    pub(crate) span: (usize, usize),
    depth: usize,
}

impl Node {
    fn new(kind: Kind, span: (usize, usize)) -> Self {
        let depth = match &kind {
            Kind::Number(_) | Kind::Input(_) | Kind::Local(_) => 0,
            Kind::Unary(_, a) | Kind::Whole(a, _) => a.depth,
            Kind::Binary(_, a, b) => a.depth.max(b.depth),
        };
        Self {
            kind,
            span,
            depth: depth + 1,
        }
    }

    /// True where both are the same expression, wherever it stands.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        match (&self.kind, &other.kind) {
            (Kind::Unary(f, a), Kind::Unary(g, b)) => f == g && a.is_same(b),
            (Kind::Binary(f, a, c), Kind::Binary(g, b, d)) => {
                f == g && a.is_same(b) && c.is_same(d)
            }
            (Kind::Whole(a, n), Kind::Whole(b, m)) => n == m && a.is_same(b),
            (a, b) => a == b,
        }
    }
}

/// What a name stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Meaning {
    /// A quantity from outside.
    Input(usize),
    /// A named intermediate.
    Local(usize),
}

/// An expression of the file.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Expression {
    /// Where it stands in the file.
    pub(crate) place: String,
    pub(crate) text: String,
    pub(crate) root: Node,
}

impl Expression {
    /// Reads an expression. `names` are those that it may use.
    pub(crate) fn parse(
        place: &str,
        text: &str,
        names: &[(String, Meaning)],
    ) -> Result<Self, OwnError> {
        if text.len() > LONGEST {
            return Err(OwnError::TooMuch {
                what: format!("{place}: letters of an expression"),
                found: text.len(),
                most: LONGEST,
            });
        }
        let mut parser = Parser {
            place,
            text,
            names,
            at: 0,
            nested: 0,
        };
        let root = parser.sum()?;
        parser.skip();
        if let Some(letter) = parser.peek() {
            return Err(parser.fault(format!("`{letter}` is not expected here")));
        }
        Ok(Self {
            place: place.to_owned(),
            text: text.to_owned(),
            root,
        })
    }

    /// The text of a part.
    pub(crate) fn part(&self, node: &Node) -> String {
        let (start, end) = node.span;
        self.text
            .get(start..end)
            .unwrap_or_default()
            .trim()
            .to_owned()
    }
}

struct Parser<'a> {
    place: &'a str,
    text: &'a str,
    names: &'a [(String, Meaning)],
    /// The next byte.
    at: usize,
    nested: usize,
}

impl Parser<'_> {
    fn fault(&self, what: impl Into<String>) -> OwnError {
        OwnError::Syntax {
            place: self.place.to_owned(),
            column: self.text[..self.at].chars().count() + 1,
            what: what.into(),
            text: self.text.to_owned(),
        }
    }

    fn peek(&self) -> Option<char> {
        self.text[self.at..].chars().next()
    }

    fn skip(&mut self) {
        let rest = &self.text[self.at..];
        self.at += rest.len() - rest.trim_start().len();
    }

    /// Takes one of these signs, if it comes next.
    fn take(&mut self, signs: &[char]) -> Option<char> {
        self.skip();
        let found = self.peek().filter(|letter| signs.contains(letter))?;
        self.at += found.len_utf8();
        Some(found)
    }

    fn node(&self, kind: Kind, span: (usize, usize)) -> Result<Node, OwnError> {
        let node = Node::new(kind, span);
        if node.depth > DEEPEST {
            return Err(OwnError::TooMuch {
                what: format!("{}: depth of the expression", self.place),
                found: node.depth,
                most: DEEPEST,
            });
        }
        Ok(node)
    }

    fn binary(&self, of: Binary, a: Node, b: Node) -> Result<Node, OwnError> {
        let span = (a.span.0, b.span.1);
        self.node(Kind::Binary(of, Box::new(a), Box::new(b)), span)
    }

    /// Runs a rule one level deeper.
    fn deeper<T>(
        &mut self,
        rule: impl FnOnce(&mut Self) -> Result<T, OwnError>,
    ) -> Result<T, OwnError> {
        self.nested += 1;
        if self.nested > NESTED {
            return Err(OwnError::TooMuch {
                what: format!("{}: parentheses within each other", self.place),
                found: self.nested,
                most: NESTED,
            });
        }
        let found = rule(self);
        self.nested -= 1;
        found
    }

    fn sum(&mut self) -> Result<Node, OwnError> {
        let mut sum = self.product()?;
        while let Some(sign) = self.take(&['+', '-']) {
            let of = if sign == '+' {
                Binary::Add
            } else {
                Binary::Subtract
            };
            let term = self.product()?;
            sum = self.binary(of, sum, term)?;
        }
        Ok(sum)
    }

    fn product(&mut self) -> Result<Node, OwnError> {
        let mut product = self.factor()?;
        while let Some(sign) = self.take(&['*', '/']) {
            let of = if sign == '*' {
                Binary::Multiply
            } else {
                Binary::Divide
            };
            let factor = self.factor()?;
            product = self.binary(of, product, factor)?;
        }
        Ok(product)
    }

    fn factor(&mut self) -> Result<Node, OwnError> {
        self.skip();
        let start = self.at;
        if self.take(&['-']).is_some() {
            let inner = self.deeper(Self::factor)?;
            let end = inner.span.1;
            return self.node(Kind::Unary(Unary::Minus, Box::new(inner)), (start, end));
        }
        self.power()
    }

    fn power(&mut self) -> Result<Node, OwnError> {
        let base = self.atom()?;
        if self.take(&['^']).is_none() {
            return Ok(base);
        }
        let exponent = self.deeper(Self::factor)?;
        let span = (base.span.0, exponent.span.1);
        match whole(&exponent) {
            Some(power) => self.node(Kind::Whole(Box::new(base), power), span),
            None => self.binary(Binary::Power, base, exponent),
        }
    }

    fn atom(&mut self) -> Result<Node, OwnError> {
        self.skip();
        let start = self.at;
        match self.peek() {
            None => Err(self.fault("something is missing at the end")),
            Some('(') => {
                self.at += 1;
                let mut inner = self.deeper(Self::sum)?;
                self.close()?;
                inner.span = (start, self.at);
                Ok(inner)
            }
            Some(letter) if letter.is_ascii_digit() || letter == '.' => self.number(),
            Some(letter) if letter.is_ascii_alphabetic() || letter == '_' => {
                let rest = &self.text[start..];
                let len = rest
                    .find(|letter: char| !(letter.is_ascii_alphanumeric() || letter == '_'))
                    .unwrap_or(rest.len());
                let name = &rest[..len];
                self.at += len;
                if self.take(&['(']).is_some() {
                    self.call(name, start)
                } else {
                    self.named(name, start)
                }
            }
            Some(letter) => Err(self.fault(format!("`{letter}` is not expected here"))),
        }
    }

    fn close(&mut self) -> Result<(), OwnError> {
        match self.take(&[')']) {
            Some(_) => Ok(()),
            None => Err(self.fault("a `)` is missing")),
        }
    }

    fn number(&mut self) -> Result<Node, OwnError> {
        let start = self.at;
        let bytes = self.text.as_bytes();
        let digits = |mut at: usize| {
            while bytes
                .get(at)
                .is_some_and(|byte| byte.is_ascii_digit() || *byte == b'.')
            {
                at += 1;
            }
            at
        };
        let mut end = digits(start);
        if matches!(bytes.get(end), Some(b'e' | b'E')) {
            let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
            if bytes.get(end + 1 + sign).is_some_and(u8::is_ascii_digit) {
                end = digits(end + 1 + sign);
            }
        }
        let text = &self.text[start..end];
        let value = text.parse::<f64>().ok().filter(|value| value.is_finite());
        let value = value.ok_or_else(|| self.fault(format!("`{text}` is no finite number")))?;
        self.at = end;
        self.node(Kind::Number(value), (start, end))
    }

    fn named(&mut self, name: &str, start: usize) -> Result<Node, OwnError> {
        let known = self.names.iter().find(|(known, _)| known == name);
        let span = (start, start + name.len());
        match known {
            Some((_, Meaning::Input(at))) => self.node(Kind::Input(*at), span),
            Some((_, Meaning::Local(at))) => self.node(Kind::Local(*at), span),
            None => Err(self.unknown(name)),
        }
    }

    fn unknown(&self, name: &str) -> OwnError {
        let mut known: Vec<&str> = self.names.iter().map(|(name, _)| name.as_str()).collect();
        known.extend(functions());
        let hint = if name.starts_with("nu_dot") {
            "; an acceleration is not known when forces are computed: give its coefficient in [inertia]".to_owned()
        } else {
            hint(name, known.iter().copied())
        };
        OwnError::UnknownName {
            place: self.place.to_owned(),
            found: name.to_owned(),
            hint,
            known: known.join(", "),
        }
    }

    fn call(&mut self, name: &str, start: usize) -> Result<Node, OwnError> {
        let mut arguments = self.deeper(|parser| {
            let mut arguments = vec![parser.sum()?];
            while parser.take(&[',']).is_some() {
                // More than any function takes; the list itself stays short.
                if arguments.len() > 3 {
                    break;
                }
                arguments.push(parser.sum()?);
            }
            Ok(arguments)
        })?;
        self.close()?;
        let span = (start, self.at);
        let count = arguments.len();
        let mut next = || arguments.remove(0);
        if let Some((_, of)) = UNARY.iter().find(|(known, _)| *known == name) {
            if count != 1 {
                return Err(self.fault(format!("{name} takes one number, not {count}")));
            }
            return self.node(Kind::Unary(*of, Box::new(next())), span);
        }
        let mut node = match (name, count) {
            ("min", 2) => self.binary(Binary::Min, next(), next())?,
            ("max", 2) => self.binary(Binary::Max, next(), next())?,
            ("clamp", 3) => {
                let (x, low, high) = (next(), next(), next());
                let above = self.binary(Binary::Max, x, low)?;
                self.binary(Binary::Min, above, high)?
            }
            ("norm", 2 | 3) => {
                let mut sum: Option<Node> = None;
                for _ in 0..count {
                    let of = next();
                    let span = of.span;
                    let square = self.node(Kind::Whole(Box::new(of), 2), span)?;
                    sum = Some(match sum {
                        None => square,
                        Some(sum) => self.binary(Binary::Add, sum, square)?,
                    });
                }
                let sum = sum.ok_or_else(|| self.fault("norm takes two or three numbers"))?;
                self.node(Kind::Unary(Unary::Sqrt, Box::new(sum)), span)?
            }
            _ if SEVERAL.contains(&name) => {
                let wanted = match name {
                    "clamp" => "three numbers: clamp(x, low, high)",
                    "norm" => "two or three numbers",
                    _ => "two numbers",
                };
                return Err(self.fault(format!("{name} takes {wanted}, not {count}")));
            }
            _ => return Err(self.unknown(name)),
        };
        node.span = span;
        Ok(node)
    }
}

/// The whole number that an exponent is, where it is one.
fn whole(exponent: &Node) -> Option<i32> {
    let (sign, node) = match &exponent.kind {
        Kind::Unary(Unary::Minus, inner) => (-1.0, &**inner),
        _ => (1.0, exponent),
    };
    match node.kind {
        Kind::Number(value) if value.fract() == 0.0 && value <= 12.0 => Some((sign * value) as i32),
        _ => None,
    }
}
