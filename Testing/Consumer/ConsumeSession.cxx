// A training session in a patient's arteries without any window: a wire is driven for two seconds, then an X-ray image
// is made. Usage: consume-session RUN
#include <DynamicCoronary/SessionImager.h>
#include <DynamicCoronary/TrainingSession.h>
#include <DynamicCoronary/VesselModel.h>

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <iostream>

namespace
{
constexpr double Seconds = 2.0;
constexpr double Speed = 15.0; // mm/s that the wire is pushed
}

int main(int argc, char** argv)
{
  if (argc != 2)
  {
    std::cerr << "Usage: consume-session RUN\n";
    return EXIT_FAILURE;
  }
  try
  {
    // Instruments, X-rays and contrast medium of a built-in scenario; the vessels are the patient's.
    coronary::Scenario scenario = coronary::LoadScenario("phantom-lca");
    scenario.vessels.kind = coronary::VesselSource::Kind::Run;
    scenario.vessels.path = argv[1];
    const coronary::VesselModel model = coronary::LoadVessels(scenario.vessels);
    scenario.imaging.pose = coronary::StartPose(model.wall->Topology(), scenario.imaging);

    coronary::TrainingSession session(model.wall, scenario);
    coronary::SessionInput input = session.StartInput();
    input.pedals = coronary::FluoroscopyPedal;
    const auto ticks = static_cast<std::uint64_t>(std::lround(Seconds * session.TickRate()));
    std::uint64_t frames = 0;
    coronary::SessionSnapshot moment;
    for (std::uint64_t tick = 0; tick < ticks; ++tick)
    {
      input.drive.wirePosition += Speed / session.TickRate();
      if (session.Step(input).exposed)
      {
        session.SnapshotOfImage(moment);
        ++frames;
      }
    }
    for (const std::string& message : session.TakeMessages())
    {
      std::cout << message << '\n';
    }
    const coronary::TickReport& report = session.Report().tick;
    std::cout << session.Ticks() << " ticks: the wire is " << report.inserted
              << " mm beyond the catheter, in "
              << (report.branch < 0
                     ? "the catheter"
                     : session.Topology().groupName[static_cast<std::size_t>(report.branch)])
              << "; hand " << report.proximalForce << " N\n";

    const auto chest = coronary::MakeProjector(
      coronary::LoadBackground(scenario, model.wall->Topology()).volume, scenario.imaging);
    coronary::SessionImager imager(model.wall->Topology(), scenario, chest, false);
    const coronary::GreyImage& image = imager.Expose(moment);
    std::cout << frames << " exposures; the last is an image of " << image.columns << " x "
              << image.rows << " pixels\n";
    return report.inserted > 10.0 && frames > 20 && image.columns == scenario.imaging.columns
      ? EXIT_SUCCESS
      : EXIT_FAILURE;
  }
  catch (const std::exception& error)
  {
    std::cerr << error.what() << '\n';
    return EXIT_FAILURE;
  }
}
