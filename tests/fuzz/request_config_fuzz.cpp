// A configuration file in any bytes.
#include "tests/fuzz/request_check.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    gonio::fuzz::check_config({reinterpret_cast<const char*>(data), size});
    return 0;
}
