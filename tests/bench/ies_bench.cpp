// How fast photometric files are read, beside the limit: a pass that only scans the numbers of the same bytes.
// Usage: ies_bench [FILE…]; without files a thousand typical ones are generated. Single thread; the best of several
// passes counts, since the rest is what other processes took.
#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>
#include <vector>

#include "ies/photometry_file.h"
#include "ies/quantities.h"
#include "ies/synthetic.h"

namespace {

double seconds(const auto& work) {
    const auto begin = std::chrono::steady_clock::now();
    work();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

double best_of(int passes, const auto& work) {
    double best = std::numeric_limits<double>::infinity();
    for (int i = 0; i < passes; ++i) best = std::min(best, seconds(work));
    return best;
}

// The limit: every token that starts like a number goes through std::from_chars, everything else is skipped.
double scan_numbers(const std::string& text) {
    double sum = 0.0;
    const char* p = text.data();
    const char* const end = p + text.size();
    while (p != end) {
        double value = 0.0;
        const auto [stop, status] = std::from_chars(p, end, value);
        if (status == std::errc{} && value < 1e30) sum += value;
        p = stop == p ? p + 1 : stop;
    }
    return sum;
}

std::vector<std::string> typical_files() {
    std::vector<std::string> files;
    const auto luminaires = gonio::ies::synthetic_luminaires();
    for (std::size_t i = 0; i < 1000; ++i)
        files.push_back(gonio::ies::synthetic_lm63(luminaires[i % luminaires.size()].name));
    return files;
}

void row(const char* name, double time_s, double baseline_s, std::size_t files, std::size_t bytes) {
    std::printf("%-34s %9.1f files/s %8.1f MB/s %6.2f x of scanning %8.3f s\n", name,
                static_cast<double>(files) / time_s, static_cast<double>(bytes) / time_s * 1e-6, time_s / baseline_s,
                time_s);
}

}  // namespace

int main(int argc, char** argv) {
    std::vector<std::string> files;
    for (int i = 1; i < argc; ++i) {
        std::ifstream stream(argv[i], std::ios::binary);
        files.emplace_back(std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>());
    }
    if (files.empty()) files = typical_files();
    std::size_t bytes = 0;
    for (const std::string& file : files) bytes += file.size();
    constexpr int kPasses = 9;
    double sink = 0.0;
    std::size_t refused = 0;
    const double scan = best_of(kPasses, [&] {
        for (const std::string& file : files) sink += scan_numbers(file);
    });
    const double read = best_of(kPasses, [&] {
        refused = 0;
        for (const std::string& file : files) {
            const auto result = gonio::ies::read_photometry(file);
            if (result) sink += static_cast<double>(result->web.candela.back());
            refused += result ? 0 : 1;
        }
    });
    const double full = best_of(3, [&] {
        for (const std::string& file : files) {
            const auto result = gonio::ies::read_photometry(file);
            if (result) sink += gonio::ies::quantities(*result).total.in(gonio::lm);
        }
    });
    std::printf("%zu files, %.2f MB, %zu refused (checksum %g)\n", files.size(), static_cast<double>(bytes) * 1e-6,
                refused, sink);
    row("scan numbers only", scan, scan, files.size(), bytes);
    row("read_photometry", read, scan, files.size(), bytes);
    row("read_photometry and quantities", full, scan, files.size(), bytes);
    return 0;
}
