// Where nothing may come between: tables that are made once, at their first use.
#pragma once

namespace pycraft {

// As long as it lives this thread asks for no interrupt.
class WithoutInterrupts {
 public:
  WithoutInterrupts();
  ~WithoutInterrupts();
  WithoutInterrupts(const WithoutInterrupts&) = delete;
};

}  // namespace pycraft
