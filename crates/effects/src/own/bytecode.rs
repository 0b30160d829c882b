//! Compiled expressions: a list of instructions for a machine with a stack and named intermediates, both of fixed size.
//!
//! The fit and the plugin run the same program, over plain numbers or over numbers that carry derivatives along.

use super::{
    error::OwnError,
    expression::{Binary, Expression, Kind, Node, Unary},
};
use crate::dual::{Scalar, real};

/// Numbers on the stack at once.
const STACK: usize = 40;
/// Named intermediates.
pub(crate) const LOCALS: usize = 16;
/// Most instructions of a program.
const LONGEST: usize = 2000;

/// One instruction.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Instruction {
    /// Puts a number on the stack.
    Number(f64),
    /// Puts an input on the stack.
    Input(usize),
    /// Puts an intermediate on the stack.
    Local(usize),
    /// Takes one number off the stack and puts its function there.
    Unary(Unary),
    /// Takes two.
    Binary(Binary),
    /// A whole power of the last.
    Whole(i32),
    /// Takes the last off the stack into an intermediate.
    Store(usize),
    /// Takes the last off the stack into an output.
    Output(usize),
}

/// A compiled list of expressions.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Program {
    instructions: Vec<Instruction>,
}

impl Program {
    /// Compiles outputs, each with its place among them, and what they need of `locals`, which do not name each other in
    /// a circle.
    pub(crate) fn compile<'a>(
        outputs: impl IntoIterator<Item = (usize, &'a Expression)>,
        locals: &[Expression],
    ) -> Result<Self, OwnError> {
        let mut compiler = Compiler {
            locals,
            known: vec![false; locals.len()],
            instructions: Vec::new(),
        };
        for (at, expression) in outputs {
            compiler.expression(expression, Instruction::Output(at))?;
        }
        Ok(Self {
            instructions: compiler.instructions,
        })
    }

    /// Runs it; `outputs` that it does not write stay as they are.
    pub(crate) fn run<D: Scalar>(&self, inputs: &[D], outputs: &mut [D]) {
        let mut stack = [D::from(0.0); STACK];
        let mut locals = [D::from(0.0); LOCALS];
        // The compiler has counted: the height never leaves the stack.
        let mut height = 0;
        for instruction in &self.instructions {
            match *instruction {
                Instruction::Number(value) => {
                    stack[height] = D::from(value);
                    height += 1;
                }
                Instruction::Input(at) => {
                    stack[height] = inputs[at];
                    height += 1;
                }
                Instruction::Local(at) => {
                    stack[height] = locals[at];
                    height += 1;
                }
                Instruction::Unary(of) => stack[height - 1] = unary(of, stack[height - 1]),
                Instruction::Whole(power) => stack[height - 1] = stack[height - 1].powi(power),
                Instruction::Binary(of) => {
                    stack[height - 2] = binary(of, stack[height - 2], stack[height - 1]);
                    height -= 1;
                }
                Instruction::Store(at) => {
                    height -= 1;
                    locals[at] = stack[height];
                }
                Instruction::Output(at) => {
                    height -= 1;
                    outputs[at] = stack[height];
                }
            }
        }
    }
}

/// A function of one number. At a kink the derivative is that of one side or zero, never infinite.
fn unary<D: Scalar>(of: Unary, a: D) -> D {
    match of {
        Unary::Minus => -a,
        Unary::Abs if real(a) < 0.0 => -a,
        Unary::Abs => a,
        Unary::Sign if real(a) == 0.0 => D::from(0.0),
        Unary::Sign => D::from(real(a).signum()),
        Unary::Step if real(a).is_nan() => a,
        Unary::Step => D::from(f64::from(u8::from(real(a) > 0.0))),
        Unary::Sqrt if real(a) == 0.0 => D::from(0.0),
        Unary::Sqrt => a.sqrt(),
        Unary::Exp => a.exp(),
        Unary::Ln => a.ln(),
        Unary::Sin => a.sin(),
        Unary::Cos => a.cos(),
        Unary::Tanh => a.tanh(),
        Unary::Atan => a.atan(),
    }
}

fn binary<D: Scalar>(of: Binary, a: D, b: D) -> D {
    match of {
        Binary::Add => a + b,
        Binary::Subtract => a - b,
        Binary::Multiply => a * b,
        Binary::Divide => a / b,
        Binary::Power if real(a) == 0.0 => D::from(real(a).powf(real(b))),
        Binary::Power => a.powd(b),
        // What is not a number stays one, whichever side it is on.
        Binary::Min if real(b) < real(a) || real(b).is_nan() => b,
        Binary::Max if real(b) > real(a) || real(b).is_nan() => b,
        Binary::Min | Binary::Max => a,
    }
}

struct Compiler<'a> {
    locals: &'a [Expression],
    /// Which of them are computed already.
    known: Vec<bool>,
    instructions: Vec<Instruction>,
}

impl Compiler<'_> {
    fn expression(&mut self, expression: &Expression, end: Instruction) -> Result<(), OwnError> {
        self.needed(&expression.root)?;
        self.node(expression, &expression.root, 0)?;
        self.instructions.push(end);
        if self.instructions.len() > LONGEST {
            return Err(OwnError::TooMuch {
                what: format!("{}: instructions so far", expression.place),
                found: self.instructions.len(),
                most: LONGEST,
            });
        }
        Ok(())
    }

    /// Computes the intermediates that a part needs.
    fn needed(&mut self, node: &Node) -> Result<(), OwnError> {
        match &node.kind {
            Kind::Number(_) | Kind::Input(_) => Ok(()),
            Kind::Local(at) => {
                if self.known[*at] {
                    return Ok(());
                }
                self.known[*at] = true;
                let locals = self.locals;
                self.expression(&locals[*at], Instruction::Store(*at))
            }
            Kind::Unary(_, a) | Kind::Whole(a, _) => self.needed(a),
            Kind::Binary(_, a, b) => {
                self.needed(a)?;
                self.needed(b)
            }
        }
    }

    /// Computes a part above `height` numbers.
    fn node(&mut self, of: &Expression, node: &Node, height: usize) -> Result<(), OwnError> {
        if height >= STACK {
            return Err(OwnError::TooMuch {
                what: format!("{}: numbers kept at once", of.place),
                found: height + 1,
                most: STACK,
            });
        }
        let instruction = match &node.kind {
            Kind::Number(value) => Instruction::Number(*value),
            Kind::Input(at) => Instruction::Input(*at),
            Kind::Local(at) => Instruction::Local(*at),
            Kind::Unary(function, a) => {
                self.node(of, a, height)?;
                Instruction::Unary(*function)
            }
            Kind::Whole(a, power) => {
                self.node(of, a, height)?;
                Instruction::Whole(*power)
            }
            Kind::Binary(function, a, b) => {
                self.node(of, a, height)?;
                self.node(of, b, height + 1)?;
                Instruction::Binary(*function)
            }
        };
        self.instructions.push(instruction);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::own::expression::Meaning;

    fn program(text: &str, locals: &[(&str, &str)]) -> Result<Program, OwnError> {
        let mut names = vec![("x".to_owned(), Meaning::Input(0))];
        names.extend(
            locals
                .iter()
                .enumerate()
                .map(|(at, (name, _))| ((*name).to_owned(), Meaning::Local(at))),
        );
        let locals: Vec<Expression> = locals
            .iter()
            .map(|(name, text)| Expression::parse(name, text, &names).expect("an expression"))
            .collect();
        let of = Expression::parse("f", text, &names)?;
        Program::compile([(0, &of)], &locals)
    }

    fn value(text: &str, x: f64) -> f64 {
        let mut out = [f64::NAN];
        program(text, &[]).expect("a program").run(&[x], &mut out);
        out[0]
    }

    #[test]
    fn precedence_is_that_of_arithmetic() {
        for (text, expected) in [
            ("1 + 2 * 3", 7.0),
            ("8 / 4 / 2", 1.0),
            ("7 - 4 - 2", 1.0),
            ("-2^2", -4.0),
            ("2^3^2", 512.0),
            ("2^-1", 0.5),
            ("(1 + 2) * 3", 9.0),
            ("-x * -x", 9.0),
            ("1.5e1 + .5", 15.5),
            ("norm(3, 4) + norm(2, 3, 6)", 12.0),
            ("clamp(x, 0, 2) + min(1, 2) + max(1, 2)", 5.0),
            ("sign(-x) + step(x) + step(-x) + sign(0)", 0.0),
            ("abs(-x) + sqrt(16) + x^0.5^0 ", 10.0),
        ] {
            assert_eq!(value(text, 3.0), expected, "{text}");
        }
        assert!((value("exp(ln(x)) + sin(x)^2 + cos(x)^2", 3.0) - 4.0).abs() < 1e-12);
        assert!((value("tanh(x) + atan(x) + x^1.5", 3.0) - 7.440_252_948_791).abs() < 1e-9);
    }

    #[test]
    fn intermediates_are_computed_once_and_only_where_needed() {
        let locals = [("a", "b + 1"), ("b", "2 * x"), ("c", "a * a")];
        let of = program("a * b", &locals).expect("a program");
        let mut out = [0.0];
        of.run(&[3.0], &mut out);
        assert_eq!(out[0], 42.0);
        let stores = |of: &Program| {
            let stored = |i: &&Instruction| matches!(i, Instruction::Store(_));
            of.instructions.iter().filter(stored).count()
        };
        assert_eq!(stores(&of), 2);
        assert_eq!(stores(&program("x", &locals).expect("a program")), 0);
    }

    #[test]
    fn kinks_have_finite_slopes() {
        use num_dual::DualSVec64;
        for text in [
            "sqrt(x)",
            "norm(x, x)",
            "abs(x)",
            "x^1.5",
            "max(x, 0)",
            "sign(x)",
        ] {
            let x = DualSVec64::<1>::from(0.0).derivative(0);
            let mut out = [x];
            program(text, &[]).expect("a program").run(&[x], &mut out);
            let slope = out[0].eps.0.map_or(0.0, |of| of[0]);
            assert!(out[0].re == 0.0 && slope.is_finite(), "{text}: {slope}");
        }
    }
}
