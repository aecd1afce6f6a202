// The target of an HTTP request in any bytes.
#include "tests/fuzz/request_check.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    gonio::fuzz::check_target({reinterpret_cast<const char*>(data), size});
    return 0;
}
