#include "tests/stress/stress.h"

#include <cstdlib>
#include <ostream>
#include <stdexcept>

namespace gonio::stress {
namespace {

struct Case {
    const char* name;
    void (*run)(Bench&);
};
constexpr Case kCases[] = {{"contact", contact},
                           {"singularity", singularity},
                           {"scale", scale},
                           {"intensity", intensity},
                           {"degenerate", degenerate},
                           {"seams", seams},
                           {"steps", steps},
                           {"convergence", convergence},
                           {"bounces", bounces},
                           {"cavities", cavities},
                           {"fuzz", fuzz}};
// Below this many seconds the sweeps are thinned out.
constexpr double kBriefSeconds = 60.0;

}  // namespace

CLI::App* add_subcommand(CLI::App& app, Options& options) {
    CLI::App* stress = app.add_subcommand("stress", "adversarial and random scenes; every buffer is checked");
    stress->add_option("--seconds", options.seconds, "about how long; below 60 the sweeps are thinned out")
        ->check(CLI::Range(1.0, 86400.0))
        ->capture_default_str();
    stress->add_option("--seed", options.seed, "of rotations and of the first random scene")->capture_default_str();
    stress->add_option("--case", options.only, "only this one");
    stress->add_option("--device", options.device, "index of the EGL device");
    stress->add_flag("--json", options.json, "print findings as JSON");
    return stress;
}

int run_stress(const Options& options, std::ostream& out) {
    std::unique_ptr<gl::Context> context;
    try {
        context = gl::Context::create({options.device, true});
    } catch (const std::runtime_error& error) {
        out << error.what() << "\n";
        // Where EGL is known to be, a missing context is a failure; elsewhere the run is skipped.
        return std::getenv("CI") != nullptr ? 1 : 77;
    }
    Findings findings;
    Renderer renderer(*context);
    renderer.set_surfels({0.06, 1000, 4000});  // many scenes: what fewer surfels lose in accuracy the bounds allow
    renderer.set_links(kLinks);
    const auto start = std::chrono::steady_clock::now();
    Bench bench{renderer, findings, options.seed, options.seconds < kBriefSeconds, start, "", ""};
    bench.until = start + std::chrono::duration_cast<std::chrono::steady_clock::duration>(
                              std::chrono::duration<double>(options.seconds));
    bool any = false;
    for (const Case& one : kCases) {
        if (!options.only.empty() && options.only != one.name) continue;
        any = true;
        const auto begun = std::chrono::steady_clock::now();
        one.run(bench);
        findings.took(one.name, std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count());
        if (context->debug_messages() > 0) {
            findings.of(one.name, "GL debug messages", 0.0).note(context->debug_messages(), [&] {
                return context->last_debug_message();
            });
        }
    }
    if (!any) {
        out << "gonio-bench stress: there is no case '" << options.only << "'\n";
        return 2;
    }
    if (options.json)
        print_json(findings, context->renderer(), options.seed, out);
    else
        print_table(findings, out);
    return findings.passed() ? 0 : 1;
}

}  // namespace gonio::stress
