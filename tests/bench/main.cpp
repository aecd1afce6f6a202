#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <fstream>
#include <iostream>
#include <sstream>
#include <stdexcept>
#include <string_view>

#include "server/app/dump_options.h"
#include "tests/accuracy/command.h"
#include "tests/bench/bake_bench.h"
#include "tests/bench/frames.h"
#include "tests/bench/haze.h"
#include "tests/bench/lights.h"
#include "tests/bench/machine.h"
#include "tests/bench/pareto.h"
#include "tests/bench/refinement.h"
#include "tests/bench/report.h"
#include "tests/bench/scaling.h"
#include "tests/bench/stills.h"
#include "tests/bench/stream_bench.h"
#include "tests/bench/survey.h"
#include "tests/bench/transport_bench.h"
#include "tests/stress/stress.h"

namespace {

const CLI::Validator kSize(
    [](std::string& text) {
        int width = 0, height = 0;
        char x = 0, more = 0;
        const bool ok = std::sscanf(text.c_str(), "%d%c%d%c", &width, &x, &height, &more) == 3 && x == 'x' &&
                        width >= 2 && height >= 2 && width <= 8192 && height <= 8192;
        return ok ? std::string() : std::string("must be WIDTHxHEIGHT, each from 2 to 8192");
    },
    "WxH");

void read_size(const std::string& size, int& width_px, int& height_px) {
    if (!size.empty()) std::sscanf(size.c_str(), "%dx%d", &width_px, &height_px);
}

void write_file(const std::string& path, const std::string& text) {
    std::ofstream out(path, std::ios::binary);
    out << text;
    out.close();
    if (!out) throw std::runtime_error("cannot write " + path);
}

void run_pareto(const gonio::bench::ParetoOptions& options, int device, bool json, const std::string& csv,
                const std::string& svg) {
    for (const std::string& path : {csv, svg}) {  // an hour later would be late to find out
        if (!path.empty() && !std::ofstream(path, std::ios::app)) throw std::runtime_error("cannot write " + path);
    }
    const auto context = gonio::gl::Context::create({device, false});
    const auto result = gonio::bench::run_pareto(*context, options, std::cerr);
    if (json)
        gonio::bench::write_json(result, std::cout);
    else
        gonio::bench::print_pareto(result, std::cout);
    std::ostringstream rows;
    gonio::bench::write_csv(result, rows);
    if (!csv.empty()) write_file(csv, rows.str());
    if (!svg.empty()) write_file(svg, gonio::bench::pareto_svg(result));
}

}  // namespace

int main(int argc, char** argv) {
    gonio::FramesOptions options;
    gonio::bench::ParetoOptions pareto_options;
    std::string size = "800x800", pareto_size, csv, svg;
    bool json = false;
    CLI::App app{"gonio-bench: measures the renderer"};
    app.require_subcommand(1);
    CLI::App* frames = app.add_subcommand(
        "frames", "frame times of the seed technique and the default one, everything recomputed in each frame");
    frames->add_option("--scene", options.scene, "cornell, atrium, corridor, stage or a file; default: the first two");
    frames->add_option("--size", size, "WIDTHxHEIGHT")->capture_default_str()->check(kSize);
    frames->add_option("--seconds", options.seconds, "time per row; at least 5 and at most 50 frames")
        ->check(CLI::Range(0.1, 600.0))
        ->capture_default_str();
    frames->add_option("--device", options.device, "index of the EGL device");
    frames->add_flag("--json", options.json, "print rows as JSON");

    gonio::bench::LightsOptions lights_options;
    std::string lights_size;
    CLI::App* lights = app.add_subcommand("lights", "frame times against the number of luminaires, one change a row");
    lights->add_option("--scene", lights_options.scene, "only stage, cornell, atrium");
    lights->add_option("--lights", lights_options.lights, "only 1, 4, 16, 64 or 484 luminaires");
    lights->add_option("--change", lights_options.change,
                       "only level_one, color_one, level_all, exposure, move_one, orbit");
    lights->add_option("--size", lights_size, "WIDTHxHEIGHT; default: 800x800")->check(kSize);
    lights->add_option("--seconds", lights_options.seconds, "time per row; at least 10 and at most 100 frames")
        ->check(CLI::Range(0.1, 600.0))
        ->capture_default_str();
    lights->add_option("--haze", lights_options.haze_per_m, "extinction of haze, 1/m")
        ->check(CLI::Range(0.0, 10.0))
        ->capture_default_str();
    lights->add_option("--device", lights_options.device, "index of the EGL device");
    lights->add_flag("--json", lights_options.json, "print rows as JSON");

    gonio::ScalingOptions scaling_options;
    CLI::App* scaling =
        app.add_subcommand("scaling", "frame times by pass against size, scene and triangles; RSM sizes; efforts");
    scaling->add_option("--seconds", scaling_options.seconds, "time per row; at least 10 and at most 100 frames")
        ->check(CLI::Range(0.1, 600.0))
        ->capture_default_str();
    scaling->add_option("--device", scaling_options.device, "index of the EGL device");
    scaling->add_flag("--json", scaling_options.json, "print rows as JSON");

    CLI::App* pareto = app.add_subcommand("pareto", "run time against error of every technique");
    pareto->add_option("--scene", pareto_options.scene, "only cornell, atrium, corridor, stage; or a file");
    pareto->add_option(
        "--profile", pareto_options.profile,
        "only wide, beam, beam12, beam6, downlight; panel: wide from 0.6 x 0.6 m; haze: wide in haze of 0.01/m");
    pareto->add_option("--lights", pareto_options.lights, "only cases with this many luminaires");
    pareto->add_option("--technique", pareto_options.technique, "only default, seed");
    pareto->add_option("--size", pareto_size, "WIDTHxHEIGHT; default: 800x800")->check(kSize);
    pareto->add_option("--seconds", pareto_options.seconds, "time per row; at least 5 and at most 50 frames")
        ->check(CLI::Range(0.1, 600.0))
        ->capture_default_str();
    pareto->add_flag("--quick", pareto_options.quick, "one case, few frames, a coarse reference: checks, not figures");
    pareto->add_option("--cache", pareto_options.cache, "folder of computed references")->capture_default_str();
    pareto
        ->add_option("--reference-seconds", pareto_options.reference_seconds,
                     "spent on each truth at most; rows say how sure it is")
        ->check(CLI::Range(1.0, 86400.0))
        ->capture_default_str();
    pareto->add_option("--csv", csv, "write the rows to this file");
    pareto->add_option("--svg", svg, "write the plot to this file");
    pareto->add_option("--device", options.device, "index of the EGL device");
    pareto->add_flag("--json", json, "print rows as JSON");
    gonio::bench::TransportOptions transport_options;
    CLI::App* transport = app.add_subcommand(
        "transport", "what the transport takes beside frames, of two million triangles and of a kilometre too");
    transport->add_option("--cache", transport_options.cache, "folder of computed references")->capture_default_str();
    transport
        ->add_option("--reference-seconds", transport_options.reference_seconds,
                     "spent on each truth at most; rows say how sure it is")
        ->capture_default_str()
        ->check(CLI::Range(1.0, 86400.0));
    transport->add_option("--device", transport_options.device, "index of the EGL device");
    transport->add_flag("--json", transport_options.json, "print rows as JSON");
    gonio::bench::RefinementOptions refinement_options;
    CLI::App* refinement =
        app.add_subcommand("refinement", "how the error of a picture that nobody touches falls with time");
    refinement->add_option("--scene", refinement_options.scene, "only cornell, atrium, corridor");
    refinement->add_option("--profile", refinement_options.profile, "wide, beam, beam12 or beam6")
        ->check(CLI::IsMember({"wide", "beam", "beam12", "beam6"}))
        ->capture_default_str();
    refinement->add_option("--cache", refinement_options.cache, "folder of computed references")->capture_default_str();
    refinement
        ->add_option("--reference-seconds", refinement_options.reference_seconds,
                     "spent on each truth at most; rows say how sure it is")
        ->check(CLI::Range(1.0, 86400.0))
        ->capture_default_str();
    refinement->add_option("--device", refinement_options.device, "index of the EGL device");
    refinement->add_flag("--json", refinement_options.json, "print rows as JSON");
    gonio::bench::StillsOptions stills_options;
    std::string stills_size = "400x400";
    CLI::App* stills = app.add_subcommand("stills", "FLIP of captures to the path tracer's pictures");
    stills->add_option("--scene", stills_options.scene, "only cornell, atrium, corridor, stage");
    stills->add_option("--size", stills_size, "WIDTHxHEIGHT")->capture_default_str()->check(kSize);
    stills->add_option("--samples", stills_options.samples, "of a pixel of the path tracer's, in two halves")
        ->check(CLI::Range(2u, 65536u))
        ->capture_default_str();
    stills->add_option("--cache", stills_options.cache, "folder of computed references")->capture_default_str();
    stills->add_option("--pictures", stills_options.pictures, "write the pictures to this folder");
    stills->add_option("--device", stills_options.device, "index of the EGL device");
    stills->add_flag("--json", stills_options.json, "print rows as JSON");
    gonio::bench::StreamOptions stream_options;
    CLI::App* stream = app.add_subcommand(
        "stream", "what a viewer's decoder shows of the pictures that were encoded, moving and at rest");
    stream->add_option("--scene", stream_options.scene, "only cornell, atrium");
    stream->add_option("--pictures", stream_options.pictures, "write pictures to this folder, encoded and decoded");
    stream->add_option("--device", stream_options.device, "index of the EGL device");
    stream->add_flag("--json", stream_options.json, "print rows as JSON");
    gonio::bench::BakeBenchOptions bake_options;
    std::string bake_size = "400x400";
    CLI::App* bake = app.add_subcommand(
        "bake", "what irradiance maps take and are off by, beside the live transport; the cylinder's known values");
    bake->add_option("--scene", bake_options.scene, "only cornell, atrium, cylinder; or a file");
    bake->add_option("--size", bake_size, "WIDTHxHEIGHT of the picture whose points are compared")
        ->capture_default_str()
        ->check(kSize);
    bake->add_option("--texels", bake_options.side, "a side of the maps")
        ->check(CLI::Range(16, 8192))
        ->capture_default_str();
    bake->add_option("--directions", bake_options.directions, "rays of a texel and bounce")
        ->check(CLI::Range(32, 65536))
        ->capture_default_str();
    bake->add_option("--reference-seconds", bake_options.reference_seconds,
                     "of the path tracer at most, for each scene")
        ->check(CLI::Range(1.0, 86400.0))
        ->capture_default_str();
    bake->add_flag("--reference-case", bake_options.reference_case,
                   "the seed's case instead: cylinder, 2304 texels a side, 256 directions, 30 even steps of air");
    bake->add_option("--share", bake_options.share, "of --reference-case: of its texels a side, 0.01 to 1")
        ->check(CLI::Range(0.01, 1.0))
        ->capture_default_str();
    bake->add_option("--device", bake_options.device, "index of the EGL device");
    bake->add_flag("--json", bake_options.json, "print rows as JSON");
    gonio::bench::HazeBenchOptions haze_options;
    CLI::App* haze =
        app.add_subcommand("haze", "beams in haze of the live picture beside the path tracer: errors, bands, flicker");
    haze->add_option("--scene", haze_options.scene, "only cornell, atrium, stage; or a file");
    haze->add_option("--extinction", haze_options.extinction_per_m, "of the haze, 1/m")
        ->check(CLI::Range(1e-5, 10.0))
        ->capture_default_str();
    haze->add_option("--reference-seconds", haze_options.reference_seconds,
                     "of the path tracer at most, for each of its two halves")
        ->check(CLI::Range(1.0, 86400.0))
        ->capture_default_str();
    haze->add_option("--device", haze_options.device, "index of the EGL device");
    haze->add_flag("--json", haze_options.json, "print rows as JSON");
    gonio::bench::SurveyOptions survey_options;
    CLI::App* survey = app.add_subcommand(
        "survey", "interactive meters beside the path tracer's in scenes that nobody tuned anything for");
    survey->add_option("paths", survey_options.paths, "scene files, folders of them, or names of built-in scenes");
    survey->add_option("--rooms", survey_options.rooms, "SEED:COUNT of random rooms besides");
    survey->add_option("--picks", survey_options.picks, "points of each scene")
        ->check(CLI::Range(1u, 4096u))
        ->capture_default_str();
    survey
        ->add_option("--reference-seconds", survey_options.reference_seconds,
                     "of the path tracer for each scene at most")
        ->check(CLI::Range(1.0, 86400.0))
        ->capture_default_str();
    survey->add_option("--cache", survey_options.cache, "folder of computed references")->capture_default_str();
    survey->add_option("--bulbs", survey_options.bulbs, "in a scene without light: at the eye, and further on")
        ->check(CLI::Range(1u, 1024u))
        ->capture_default_str();
    survey
        ->add_option("--links", survey_options.links,
                     "of each surfel at most; those after 512 are for narrow beams and take longer than all others")
        ->check(CLI::Range(16u, gonio::transport::kMostLinks))
        ->capture_default_str();
    survey->add_option("--max-albedo", survey_options.max_albedo, "as of goniod, for scene files")
        ->check(CLI::Range(0.0, 1.0))
        ->capture_default_str();
    survey->add_option("--pictures", survey_options.pictures,
                       "folder for the live picture and the path tracer's of each scene, .ppm");
    survey->add_option("--device", survey_options.device, "index of the EGL device");
    survey->add_flag("--json", survey_options.json, "print rows as JSON; the table goes to stderr");
    bool machine_json = false;
    CLI::App* machine =
        app.add_subcommand("machine", "what the machine can do: arithmetic, memory, links, rays, the encoder");
    machine->add_flag("--json", machine_json, "print as JSON");

    std::string results, templates = "tests/bench", docs = "docs";
    CLI::App* report = app.add_subcommand(
        "report", "write the pages of figures in docs and their plot out of saved results, in the repository's root");
    report->add_option("results", results, "folder of tests/bench/results")->required();
    report->add_option("--templates", templates, "folder with the pages' texts")->capture_default_str();
    report->add_option("--docs", docs, "folder to write to")->capture_default_str();
    gonio::accuracy::add_commands(app);
    gonio::stress::Options stress;
    CLI::App* const stressed = gonio::stress::add_subcommand(app, stress);
    app.set_version_flag("--version", "gonio-bench " GONIO_VERSION);
    if (argc == 2 && std::string_view(argv[1]) == "--dump-options") {  // for packaging/option_texts.py
        std::cout << gonio::dump_options(app, "gonio-bench", GONIO_VERSION) << "\n";
        return 0;
    }
    try {
        app.parse(argc, argv);
        if (stressed->parsed()) return gonio::stress::run_stress(stress, std::cout);
        if (machine->parsed()) {
            const auto context = gonio::gl::Context::create({-1, false});
            gonio::bench::print_machine(gonio::bench::measure_machine(*context), machine_json, std::cout);
        } else if (survey->parsed()) {
            gonio::bench::run_survey(survey_options, std::cout, std::cerr);
        } else if (haze->parsed()) {
            gonio::bench::run_haze(haze_options, std::cout, std::cerr);
        } else if (bake->parsed()) {
            read_size(bake_size, bake_options.width_px, bake_options.height_px);
            gonio::bench::run_bake(bake_options, std::cout, std::cerr);
        } else if (transport->parsed()) {
            gonio::bench::run_transport(transport_options, std::cout, std::cerr);
        } else if (refinement->parsed()) {
            gonio::bench::run_refinement(refinement_options, std::cout, std::cerr);
        } else if (stills->parsed()) {
            read_size(stills_size, stills_options.width_px, stills_options.height_px);
            gonio::bench::run_stills(stills_options, std::cout, std::cerr);
        } else if (stream->parsed()) {
            gonio::bench::run_stream(stream_options, std::cout, std::cerr);
        } else if (report->parsed()) {
            gonio::bench::write_report(gonio::bench::make_report(results, templates), docs);
        } else if (pareto->parsed()) {
            read_size(pareto_size, pareto_options.width_px, pareto_options.height_px);
            run_pareto(pareto_options, options.device, json, csv, svg);
        } else if (scaling->parsed()) {
            gonio::run_scaling(scaling_options, std::cout);
        } else if (lights->parsed()) {
            read_size(lights_size, lights_options.width_px, lights_options.height_px);
            gonio::bench::run_lights(lights_options, std::cout);
        } else if (frames->parsed()) {
            read_size(size, options.width_px, options.height_px);
            gonio::run_frames(options, std::cout);
        }
    } catch (const CLI::ParseError& error) {
        return app.exit(error);
    } catch (const std::exception& error) {
        std::cerr << "gonio-bench: " << error.what() << "\n";
        return 1;
    }
    return 0;
}
