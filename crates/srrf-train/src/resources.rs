//! What the process asks of the system: memory that stays, and the time it used.

/// Tells glibc to keep freed memory. Training frees and takes back the same tens of megabytes at
/// every operation; by default glibc returns blocks of that size to the kernel each time, and the
/// page faults that follow cost a third of a step and more.
pub fn keep_freed_memory() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        // SAFETY: mallopt only sets parameters of the allocator; the values are within its limits.
        unsafe {
            libc::mallopt(libc::M_MMAP_THRESHOLD, 1 << 30);
            libc::mallopt(libc::M_TRIM_THRESHOLD, i32::MAX);
            libc::mallopt(libc::M_TOP_PAD, 64 << 20);
        }
    }
}

/// Processor seconds that this process used so far, all threads together.
pub fn cpu_seconds() -> f64 {
    // SAFETY: `clock` reads a counter and has no preconditions.
    let ticks = unsafe { libc::clock() };
    ticks as f64 / 1e6 // CLOCKS_PER_SEC is a million on every POSIX system.
}
