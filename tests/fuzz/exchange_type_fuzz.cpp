#include <cstdint>

#include "tests/fuzz/exchange_import.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    gonio::fuzz::check_fixture_type({reinterpret_cast<const char*>(data), size});
    return 0;
}
