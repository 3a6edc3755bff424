// A shared library for LD_PRELOAD that guards the memory of the installed core, without a second build (make campaign-guarded; Linux).
//
// Each block that pycraft/_core allocates is filled with NaN, ends at a page without access, and its addresses are never used again. An access
// past the end, up to the alignment of the block's size, or after the release ends the process; a value that was never written is NaN in the
// result, which the campaign compares with NumPy. A release checks that nothing was written before the block. Slower than the core alone by ten.
#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <link.h>
#include <new>
#include <sys/mman.h>
#include <unistd.h>

extern "C" void* __libc_malloc(size_t);
extern "C" void* __libc_memalign(size_t, size_t);
extern "C" void* __libc_calloc(size_t, size_t);
extern "C" void* __libc_realloc(void*, size_t);
extern "C" void __libc_free(void*);

namespace {

constexpr size_t page = 4096, space = size_t(16) << 40;  // addresses for four billion small blocks
constexpr unsigned char unwritten = 0xff;                // eight of them are a NaN
std::atomic<char*> base{nullptr}, next{nullptr};
std::atomic<std::uintptr_t> core_begin{0}, core_end{0};
std::atomic<long> blocks{0}, beyond{0};

// One block: a page with its head, then its pages, of which it takes the end, then a page without access.
struct Head {
  size_t size;
  char* given;
};

[[noreturn]] void stop(const char* what) {
  std::fprintf(stderr, "guarded memory: %s\n", what);
  std::abort();
}

int find_core(dl_phdr_info* object, size_t, void*) {
  if (!std::strstr(object->dlpi_name, "/_core.") || !std::strstr(object->dlpi_name, "pycraft")) return 0;
  std::uintptr_t end = 0;
  for (int i = 0; i < object->dlpi_phnum; ++i)
    if (const auto& part = object->dlpi_phdr[i]; part.p_type == PT_LOAD) end = std::max<std::uintptr_t>(end, object->dlpi_addr + part.p_vaddr + part.p_memsz);
  core_begin = object->dlpi_addr, core_end = end;
  return 1;
}

bool guards(const void* caller) {
  const auto at = reinterpret_cast<std::uintptr_t>(caller);
  return at >= core_begin && at < core_end;
}
bool is_guarded(const void* p) {
  const char* const from = base;
  return from && p >= from && p < from + space;
}
size_t pages_of(size_t size) { return (size + page - 1) / page * page; }
Head* head_of(void* p) { return reinterpret_cast<Head*>((reinterpret_cast<std::uintptr_t>(p) & ~(page - 1)) - page); }

void* unguarded(size_t size, size_t alignment) { return alignment > 16 ? __libc_memalign(alignment, size) : __libc_malloc(size); }

void* guarded(size_t size, size_t alignment) {
  size = std::max<size_t>(size, 1);
  alignment = std::max(alignment, std::min<size_t>(size & -size, 64));  // arrays of doubles end at the guard to the byte
  const size_t body = pages_of(size);
  char* const at = next.fetch_add(body + 2 * page);
  if (mprotect(at, page + body, PROT_READ | PROT_WRITE)) {  // the system has no more mappings
    ++beyond;
    return unguarded(size, alignment);
  }
  std::memset(at + page, unwritten, body);
  const auto end = reinterpret_cast<std::uintptr_t>(at) + page + body;
  char* const given = reinterpret_cast<char*>((end - size) & ~(alignment - 1));
  *reinterpret_cast<Head*>(at) = {size, given};
  ++blocks;
  return given;
}

void release(void* p) {
  Head* const head = head_of(p);
  if (head->given != p) stop("released is an address that was not allocated");
  char* const at = reinterpret_cast<char*>(head);
  const size_t body = pages_of(head->size);
  if (std::any_of(at + page, static_cast<char*>(p), [](char c) { return static_cast<unsigned char>(c) != unwritten; })) stop("written before the begin of a block");
  madvise(at, page + body, MADV_DONTNEED);
  mprotect(at, page + body, PROT_NONE);
}

void* made(size_t size, size_t alignment, const void* caller) {
  void* const p = guards(caller) ? guarded(size, alignment) : unguarded(std::max<size_t>(size, 1), alignment);
  if (!p) throw std::bad_alloc();
  return p;
}

}  // namespace

// The core is loaded; what it allocates from here on is guarded.
extern "C" void guarded_memory_begin() {
  void* const at = mmap(nullptr, space, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (at == MAP_FAILED) stop("the system gives no address space");
  next = static_cast<char*>(at), base = static_cast<char*>(at);
  if (!dl_iterate_phdr(find_core, nullptr)) stop("pycraft._core is not loaded");
}
// How many blocks were guarded, and how many were not, because the system had no more mappings.
extern "C" long guarded_memory_blocks() { return blocks; }
extern "C" long guarded_memory_beyond() { return beyond; }

extern "C" void* malloc(size_t size) { return guards(__builtin_return_address(0)) ? guarded(size, size % 16 ? 8 : 16) : __libc_malloc(size); }
extern "C" void free(void* p) { is_guarded(p) ? release(p) : __libc_free(p); }
extern "C" void* calloc(size_t count, size_t size) {
  if (!guards(__builtin_return_address(0))) return __libc_calloc(count, size);
  return std::memset(guarded(count * size, 16), 0, count * size);
}
extern "C" void* realloc(void* p, size_t size) {
  if (!is_guarded(p)) return __libc_realloc(p, size);
  void* const to = guarded(size, 16);
  std::memcpy(to, p, std::min(size, head_of(p)->size));
  release(p);
  return to;
}

void* operator new(size_t size) { return made(size, 1, __builtin_return_address(0)); }
void* operator new[](size_t size) { return made(size, 1, __builtin_return_address(0)); }
void* operator new(size_t size, std::align_val_t alignment) { return made(size, size_t(alignment), __builtin_return_address(0)); }
void* operator new[](size_t size, std::align_val_t alignment) { return made(size, size_t(alignment), __builtin_return_address(0)); }
void operator delete(void* p) noexcept { free(p); }
void operator delete[](void* p) noexcept { free(p); }
void operator delete(void* p, size_t) noexcept { free(p); }
void operator delete[](void* p, size_t) noexcept { free(p); }
void operator delete(void* p, std::align_val_t) noexcept { free(p); }
void operator delete[](void* p, std::align_val_t) noexcept { free(p); }
void operator delete(void* p, size_t, std::align_val_t) noexcept { free(p); }
void operator delete[](void* p, size_t, std::align_val_t) noexcept { free(p); }
