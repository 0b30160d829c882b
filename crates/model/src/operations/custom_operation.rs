//! The part that every custom operation of Candle repeats: arguments of one precision that lie contiguous in memory, the
//! shape of the result, and gradients in the shapes of the arguments.
//!
//! [`Operation`] is an operation on the numbers of CPU tensors, applied by [`apply_2`] or [`apply_3`]. [`Derivative`] is
//! the derivative of a result that tensor operations have already computed, on any device, put into Candle's graph by
//! [`attach`].

use candle_core::{
    CpuStorage, CudaStorage, CustomOp2, CustomOp3, DType, Layout, Result, Shape, Storage, Tensor,
    backend::BackendStorage as _,
};

use crate::kernel::Real;

/// A differentiable operation on N tensors, all in f32 or all in f64.
pub(super) trait Operation<const N: usize>: Send + Sync + 'static {
    /// Its name in error messages.
    const NAME: &'static str;

    /// Shape of the result.
    fn shape(&self, arguments: [&Shape; N]) -> Result<Shape>;

    /// Numbers of the result, row-major.
    fn forward<T: Real>(&self, arguments: [&[T]; N], shapes: [&Shape; N]) -> Result<Vec<T>>;

    /// Gradients of the arguments, row-major; `None` for an argument that is data.
    fn backward<T: Real>(&self, pass: &BackwardPass<'_, N>) -> Result<[Option<Vec<T>>; N]>;
}

/// The tensors that a backward pass starts from.
pub(super) struct BackwardPass<'a, const N: usize> {
    pub(super) arguments: [&'a Tensor; N],
    pub(super) result: &'a Tensor,
    /// Gradient of the loss with respect to the result.
    pub(super) gradient: &'a Tensor,
}

/// Numbers of a tensor, row-major.
pub(super) fn values<T: Real>(tensor: &Tensor) -> Result<Vec<T>> {
    tensor.flatten_all()?.to_vec1::<T>()
}

/// Applies an operation to two tensors.
pub(super) fn apply_2<O: Operation<2>>(operation: O, [a, b]: [&Tensor; 2]) -> Result<Tensor> {
    a.contiguous()?
        .apply_op2(&b.contiguous()?, Custom(operation))
}

/// Applies an operation to three tensors.
pub(super) fn apply_3<O: Operation<3>>(operation: O, [a, b, c]: [&Tensor; 3]) -> Result<Tensor> {
    a.contiguous()?
        .apply_op3(&b.contiguous()?, &c.contiguous()?, Custom(operation))
}

/// An [`Operation`] as Candle takes it.
struct Custom<O>(O);

/// Numbers of a contiguous argument.
fn numbers<'a, T: Real>(storage: &'a CpuStorage, layout: &Layout) -> Result<&'a [T]> {
    match layout.contiguous_offsets() {
        Some((start, end)) => Ok(&T::cpu_storage_as_slice(storage)?[start..end]),
        None => candle_core::bail!("the operation takes contiguous tensors"),
    }
}

fn forward_in<T: Real, O: Operation<N>, const N: usize>(
    operation: &O,
    arguments: [(&CpuStorage, &Layout); N],
) -> Result<CpuStorage> {
    let mut slices: [&[T]; N] = [&[]; N];
    for (slice, (storage, layout)) in slices.iter_mut().zip(arguments) {
        *slice = numbers(storage, layout)?;
    }
    let shapes = arguments.map(|(_, layout)| layout.shape());
    Ok(T::to_cpu_storage_owned(operation.forward(slices, shapes)?))
}

fn forward<O: Operation<N>, const N: usize>(
    operation: &O,
    arguments: [(&CpuStorage, &Layout); N],
) -> Result<(CpuStorage, Shape)> {
    let shape = operation.shape(arguments.map(|(_, layout)| layout.shape()))?;
    let storage = match arguments[0].0 {
        CpuStorage::F32(_) => forward_in::<f32, O, N>(operation, arguments)?,
        CpuStorage::F64(_) => forward_in::<f64, O, N>(operation, arguments)?,
        _ => candle_core::bail!("{} takes f32 or f64", O::NAME),
    };
    Ok((storage, shape))
}

fn backward_in<T: Real, O: Operation<N>, const N: usize>(
    operation: &O,
    pass: &BackwardPass<'_, N>,
) -> Result<[Option<Tensor>; N]> {
    let found = operation.backward::<T>(pass)?;
    let mut gradients = [const { None }; N];
    for ((slot, values), argument) in gradients.iter_mut().zip(found).zip(pass.arguments) {
        if let Some(values) = values {
            *slot = Some(Tensor::from_vec(
                values,
                argument.shape(),
                argument.device(),
            )?);
        }
    }
    Ok(gradients)
}

fn backward<O: Operation<N>, const N: usize>(
    operation: &O,
    arguments: [&Tensor; N],
    result: &Tensor,
    gradient: &Tensor,
) -> Result<[Option<Tensor>; N]> {
    let pass = BackwardPass {
        arguments,
        result,
        gradient,
    };
    match arguments[0].dtype() {
        DType::F64 => backward_in::<f64, O, N>(operation, &pass),
        _ => backward_in::<f32, O, N>(operation, &pass),
    }
}

impl<O: Operation<2>> CustomOp2 for Custom<O> {
    fn name(&self) -> &'static str {
        O::NAME
    }

    fn cpu_fwd(
        &self,
        s1: &CpuStorage,
        l1: &Layout,
        s2: &CpuStorage,
        l2: &Layout,
    ) -> Result<(CpuStorage, Shape)> {
        forward(&self.0, [(s1, l1), (s2, l2)])
    }

    fn bwd(
        &self,
        a: &Tensor,
        b: &Tensor,
        result: &Tensor,
        gradient: &Tensor,
    ) -> Result<(Option<Tensor>, Option<Tensor>)> {
        let [a, b] = backward(&self.0, [a, b], result, gradient)?;
        Ok((a, b))
    }
}

impl<O: Operation<3>> CustomOp3 for Custom<O> {
    fn name(&self) -> &'static str {
        O::NAME
    }

    fn cpu_fwd(
        &self,
        s1: &CpuStorage,
        l1: &Layout,
        s2: &CpuStorage,
        l2: &Layout,
        s3: &CpuStorage,
        l3: &Layout,
    ) -> Result<(CpuStorage, Shape)> {
        forward(&self.0, [(s1, l1), (s2, l2), (s3, l3)])
    }

    fn bwd(
        &self,
        a: &Tensor,
        b: &Tensor,
        c: &Tensor,
        result: &Tensor,
        gradient: &Tensor,
    ) -> Result<(Option<Tensor>, Option<Tensor>, Option<Tensor>)> {
        let [a, b, c] = backward(&self.0, [a, b, c], result, gradient)?;
        Ok((a, b, c))
    }
}

/// Derivative of a known function of three tensors, in tensor operations.
pub(super) trait Derivative: Send + Sync + 'static {
    /// Its name in error messages.
    const NAME: &'static str;

    /// Gradients of the arguments.
    fn backward(&self, pass: &BackwardPass<'_, 3>) -> Result<[Tensor; 3]>;
}

/// `result`, computed outside Candle's graph from tensors that are cut off from it, as a node of the graph whose
/// derivative is given. A custom operation sees bare storages on its way forward, where only kernels of its own could
/// compute; hence the result is computed before and handed over here.
pub(super) fn attach<D: Derivative>(
    derivative: D,
    result: Tensor,
    [a, b, c]: [&Tensor; 3],
) -> Result<Tensor> {
    a.apply_op3(b, c, Attached { derivative, result })
}

struct Attached<D> {
    derivative: D,
    result: Tensor,
}

impl<D: Derivative> CustomOp3 for Attached<D> {
    fn name(&self) -> &'static str {
        D::NAME
    }

    fn cpu_fwd(
        &self,
        _: &CpuStorage,
        _: &Layout,
        _: &CpuStorage,
        _: &Layout,
        _: &CpuStorage,
        _: &Layout,
    ) -> Result<(CpuStorage, Shape)> {
        let (storage, layout) = self.result.storage_and_layout();
        match &*storage {
            Storage::Cpu(storage) => Ok((storage.clone(), layout.shape().clone())),
            _ => candle_core::bail!("{}: the result is on another device", D::NAME),
        }
    }

    fn cuda_fwd(
        &self,
        _: &CudaStorage,
        _: &Layout,
        _: &CudaStorage,
        _: &Layout,
        _: &CudaStorage,
        _: &Layout,
    ) -> Result<(CudaStorage, Shape)> {
        let (storage, layout) = self.result.storage_and_layout();
        match &*storage {
            Storage::Cuda(storage) => Ok((storage.try_clone(layout)?, layout.shape().clone())),
            _ => candle_core::bail!("{}: the result is on another device", D::NAME),
        }
    }

    fn bwd(
        &self,
        a: &Tensor,
        b: &Tensor,
        c: &Tensor,
        result: &Tensor,
        gradient: &Tensor,
    ) -> Result<(Option<Tensor>, Option<Tensor>, Option<Tensor>)> {
        let pass = BackwardPass {
            arguments: [a, b, c],
            result,
            gradient,
        };
        let [a, b, c] = self.derivative.backward(&pass)?;
        Ok((Some(a), Some(b), Some(c)))
    }
}
