// What a session of the simulator reads.
#include "FuzzHarness.h"

#include "DeviceScenario.h"
#include "DriveScript.h"
#include "InstrumentCatalogue.h"
#include "Recording.h"
#include "Scenario.h"

#include <cmath>
#include <memory>
#include <sstream>

#include <zlib.h>

using namespace coronary;

namespace fuzzing
{
namespace
{
std::string Source(const std::string& path)
{
  return Contents(std::string(DYNAMICCORONARY_SOURCE_DIR) + "/" + path);
}

void ReadScenario(const std::string& bytes)
{
  const Scenario scenario = ScenarioFromText(bytes, "'scenario'", ".");
  const std::string text = ScenarioText(scenario);
  Require(text == ScenarioText(ScenarioFromText(text, "'scenario'", ".")),
    "a scenario that is another one when it is read again");
}

std::vector<std::string> ScenarioSeeds()
{
  const std::string text = Source("Simulator/Session/scenarios/phantom-lca.json");
  return { text, ScenarioText(ScenarioFromText(text, "'scenario'", ".")) };
}

void ReadScript(const std::string& bytes)
{
  const DriveScript script = DriveScriptFromText(bytes, "'script'");
  for (const double seconds : { 0.0, 0.1, 1.0, 1e9 })
  {
    Require(std::isfinite(script.At(seconds).drive.wirePosition), "a place that is nowhere");
  }
  script.Events(0.0, script.Duration());
}

std::vector<std::string> ScriptSeeds()
{
  return {
    Source("Testing/Data/Driving/lca-angiogram.json"),
    R"({"format":"dynamiccoronary script","version":1,"pieces":[{"seconds":0.3,"wire_mm":7,"wire_deg":90},)"
    R"({"seconds":0.2,"catheter_deg":30,"catheter_mm":-1,"heart_rate_bpm":80,"pedals":["cine","mask"]}]})"
  };
}

void ReadCatalogueText(const std::string& bytes)
{
  const InstrumentCatalogue catalogue = CatalogueFromText(bytes, "'catalogue'");
  for (const CatalogueWire& wire : catalogue.wires)
  {
    Require(!wire.wire.sections.empty(), "a wire without sections");
  }
}

std::vector<std::string> CatalogueSeeds()
{
  return { Source("Simulator/Session/instruments.json") };
}

void ReadItems(RecordingReader reader, std::size_t most)
{
  RecordedItem item;
  std::uint64_t tick = 0;
  std::size_t items = 0;
  while (reader.Next(item))
  {
    Require(item.tick >= tick, "ticks that go back");
    tick = item.tick;
    Require(++items <= most, "more items than bytes");
  }
  Require(reader.HowEnded() != RecordingReader::Ending::NotYet, "no end");
  Require(!reader.EndingText().empty(), "an end that says nothing");
}

void ReadRecording(const std::string& bytes)
{
  ReadItems(
    RecordingReader(std::make_unique<std::istringstream>(bytes), "'recording'"), bytes.size());
  RecordingReplay replay(
    RecordingReader(std::make_unique<std::istringstream>(bytes), "'recording'"));
  SessionInput input;
  std::vector<RecordedEvent> events;
  for (std::uint64_t tick = 0; tick < 100 && replay.At(tick, input, events); ++tick)
  {
    std::uint64_t hash = 0;
    replay.ExpectedHash(tick + 1, hash);
  }
}

std::string SmallRecording(bool ended)
{
  std::ostringstream stream;
  RecordingHeader header;
  header.build = "seed";
  header.tickRate = 2000.0;
  {
    RecordingWriter writer(stream, header);
    SessionInput input;
    for (std::uint64_t tick = 0; ended && tick < 20; ++tick)
    {
      input.drive.wirePosition += 0.1;
      writer.Input(tick, input);
      if (tick == 10)
      {
        writer.Event(tick, { RecordedEvent::HeartRate, 80.0 });
        writer.Force(tick, { 0.1F, 0.2F, 0.3F, 0.4F });
        writer.Annotation(tick, "here");
        writer.StateHash(tick, 42);
      }
    }
    if (ended)
    {
      writer.Finish(20);
    }
  }
  return stream.str();
}

std::vector<std::string> RecordingSeeds()
{
  return { SmallRecording(true), SmallRecording(false) };
}

/// Items in a block that is well packed: bytes of type, ticks after the last one, size, payload.
void ReadItemsOfABlock(const std::string& bytes)
{
  std::string items;
  const auto put = [](std::string& to, std::uint64_t value, int size)
  {
    for (int n = 0; n < size; ++n)
    {
      to.push_back(static_cast<char>(value >> (8 * n)));
    }
  };
  for (std::size_t at = 0; at + 3 <= bytes.size();)
  {
    const std::string payload = bytes.substr(at + 3, static_cast<unsigned char>(bytes[at + 2]));
    items.push_back(bytes[at]);
    put(items, payload.size(), 4);
    put(items, static_cast<unsigned char>(bytes[at + 1]), 8);
    items += payload;
    at += 3 + payload.size();
  }
  uLongf size = compressBound(static_cast<uLong>(items.size()));
  std::string packed(size, '\0');
  compress2(reinterpret_cast<Bytef*>(packed.data()), &size,
    reinterpret_cast<const Bytef*>(items.data()), static_cast<uLong>(items.size()), 1);
  packed.resize(size);
  std::string recording = SmallRecording(false);
  put(recording, size, 4);
  put(recording, items.size(), 4);
  ReadRecording(recording + packed);
}

std::vector<std::string> ItemSeeds()
{
  const std::string force("\2\0\x10"
                          "0123456789abcdef",
    19);
  const std::string event("\3\0\x09\1"
                          "\0\0\0\0\0\0\x40\x40",
    12);
  const std::string input("\1\1\x0A\1\0\0\0\0\0\0\0\x40\x40", 13);
  const std::string hash("\4\1\x08"
                         "01234567",
    11);
  const std::string text("\6\0\2hi", 5);
  const std::string end = std::string("\7\0\x38", 3) + std::string(56, '\0');
  return { force + event + input + hash + text, end, input + end };
}

void ReadDeviceScenarioText(const std::string& bytes)
{
  const DeviceScenario scenario = DeviceScenarioFromText(bytes, "'device'");
  scenario.At(0.0);
  scenario.At(12.5);
}

std::vector<std::string> DeviceScenarioSeeds()
{
  return { R"({"format":"dynamiccoronary script","version":1,)"
           R"("pieces":[{"seconds":1,"wire_mm":5}],"device":{"repeat":true,)"
           R"("faults":[{"at":0.5,"kind":"stop","ms":100}]}})",
    R"({"format":"dynamiccoronary device scenario","version":1,)"
    R"("pieces":[{"seconds":1,"syringe_mL":-5,"pedals":["cine"]}],"repeat":true})" };
}
}

std::vector<Harness> SessionHarnesses()
{
  return {
    { "scenario", ReadScenario, ScenarioSeeds },
    { "drive-script", ReadScript, ScriptSeeds },
    { "instruments", ReadCatalogueText, CatalogueSeeds },
    { "recording", ReadRecording, RecordingSeeds },
    { "recording-items", ReadItemsOfABlock, ItemSeeds },
    { "device-scenario", ReadDeviceScenarioText, DeviceScenarioSeeds },
  };
}
}
