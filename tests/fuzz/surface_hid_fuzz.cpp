#include "tests/fuzz/surface_check.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    gonio::fuzz::check_hid({data, size});
    return 0;
}
