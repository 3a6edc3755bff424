// Counts the allocations of a test program: operator new and, on glibc, malloc are replaced. To be included by one source of a program.
// A sanitizer brings its own malloc; under one nothing is replaced and every count is zero.
#pragma once

#include <atomic>
#include <cstdlib>
#include <new>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define PYCRAFT_SANITIZED
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define PYCRAFT_SANITIZED
#endif
#endif

namespace pycraft::testing {

inline std::atomic<long> allocations{0};
#if defined(PYCRAFT_SANITIZED)
inline constexpr bool allocations_are_counted = false;
#else
inline constexpr bool allocations_are_counted = true;
#endif

// Allocations of a third call: the first two may size what is kept.
template <class F>
long allocations_of(F f) {
  f(), f();
  const long before = allocations;
  f();
  return allocations - before;
}

}  // namespace pycraft::testing

#if defined(PYCRAFT_SANITIZED)
#elif defined(__GLIBC__)
extern "C" void* __libc_malloc(size_t);
extern "C" void* malloc(size_t size) {
  ++pycraft::testing::allocations;
  return __libc_malloc(size);
}
#else
void* operator new(size_t size) {
  ++pycraft::testing::allocations;
  if (void* p = std::malloc(size)) return p;
  throw std::bad_alloc();
}
void operator delete(void* p) noexcept { std::free(p); }
void operator delete(void* p, size_t) noexcept { std::free(p); }
#endif
