//! The part of `cubecl-llvm`'s interface that `cubecl-cuda` names, without LLVM.
//!
//! `cubecl-cuda` can compile its kernels in two ways: as CUDA C++ through NVRTC (its feature `cpp`, which
//! this workspace turns on), or through LLVM. It links the second even where only the first is used, and
//! LLVM's build script downloads 200 MB from GitHub. With this crate in its place a program for CUDA builds
//! from the crates registry alone. Should anything select the LLVM way after all, compiling a kernel is an error.

use cubecl_core::ir::nvidia::SmArch;
use cubecl_core::prelude::KernelDefinition;
use cubecl_environment::backtrace::BackTrace;
use cubecl_runtime::compiler::{CompilationError, Compiler};
use cubecl_runtime::kernel::BufferIOAttr;

/// PTX versions.
pub mod nvptx {
    /// PTX versions.
    pub mod ptx_version {
        use std::fmt;

        /// A PTX version; none exists without LLVM, since NVRTC chooses its own.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub struct PtxVersion(std::convert::Infallible);

        impl PtxVersion {
            /// Always `None`: the LLVM way's own choice is left open.
            pub fn for_driver(_driver: i32) -> Option<Self> {
                None
            }
        }

        impl fmt::Display for PtxVersion {
            fn fmt(&self, _: &mut fmt::Formatter<'_>) -> fmt::Result {
                match self.0 {}
            }
        }
    }
}

/// What the LLVM way can lower.
pub mod shared {
    /// What the LLVM way can lower.
    pub mod lowered_features {
        use cubecl_core::ir::DeviceProperties;

        /// The target to restrict features for.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum GpuTarget {
            /// NVIDIA.
            Nvptx,
        }

        /// Nothing to restrict, since nothing is compiled this way.
        pub fn restrict_features(_: &mut DeviceProperties, _: GpuTarget) {}
    }
}

/// The target of a compiler.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LlvmTarget {
    /// The CPU.
    #[default]
    Cpu,
    /// NVIDIA.
    Nvptx,
}

/// A compiler that refuses every kernel.
#[derive(Clone, Debug, Default)]
pub struct PlironCompiler {
    /// What it would compile for.
    pub target: LlvmTarget,
}

/// Options of the LLVM way.
#[derive(Clone, Debug, Default)]
pub struct PlironOptions {
    /// Other GPUs than NVIDIA's.
    pub arch: Option<()>,
    /// The device.
    pub sm_arch: Option<SmArch>,
    /// The PTX version to emit.
    pub ptx_version: Option<nvptx::ptx_version::PtxVersion>,
    /// Whether scalars travel in the kernel's parameters.
    pub grid_constants: bool,
    /// Stands for the options that this crate has no use for.
    pub others: (),
}

/// A kernel compiled to PTX.
#[derive(Clone, Debug)]
pub struct NvptxModule {
    /// PTX with a NUL at its end.
    pub ptx: Vec<core::ffi::c_char>,
    /// Its entry point.
    pub entrypoint: String,
    /// Its LLVM text.
    pub ir: String,
    /// Shared memory of a launch, in bytes.
    pub shared_memory_size: usize,
    /// How each buffer is used.
    pub io: Vec<BufferIOAttr>,
}

/// What the compiler hands back.
#[derive(Clone, Debug)]
pub enum PlironArtifact {
    /// PTX.
    NvptxCode(NvptxModule),
    /// Anything else.
    Other,
}

impl std::fmt::Display for PlironArtifact {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NvptxCode(module) => f.write_str(&module.ir),
            Self::Other => Ok(()),
        }
    }
}

impl Compiler for PlironCompiler {
    type Representation = PlironArtifact;
    type CompilationOptions = PlironOptions;

    fn compile(&mut self, _: KernelDefinition, _: &PlironOptions) -> Result<PlironArtifact, CompilationError> {
        Err(CompilationError::Generic {
            reason: "this program was built without LLVM: turn on cubecl-cuda's feature `cpp`".to_owned(),
            backtrace: BackTrace::capture(),
        })
    }

    fn extension(&self) -> &'static str {
        "ll"
    }

    fn lang_tag(&self) -> &'static str {
        "llvm"
    }
}
