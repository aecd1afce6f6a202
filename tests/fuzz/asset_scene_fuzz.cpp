#include "tests/fuzz/asset_check.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    gonio::fuzz::check_scene(std::as_bytes(std::span(data, size)));
    return 0;
}
