#!/usr/bin/env bash
# From nothing to a beating coronary tree and Table 1: installs, builds, makes a gated CT series of the
# phantom with its truth, runs every stage on the images (tracking even phases only, as the paper does),
# holds the model against the truth in all phases, and renders pictures. What the model does not need,
# the simulator and ParaView's plugin, is built when the model is there.
# Everything lands in build/ and demo-output/.
set -euo pipefail

usage() {
  cat <<'EOF'
Usage: scripts/demo.sh [--no-install] [--no-pictures] [-j N]
  --no-install   use what is installed
  --no-pictures  only the data, no rendering
  -j N           parallel jobs of the build (default: all cores)
EOF
}

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
# shellcheck source=scripts/build-first.bash
source "$root/scripts/build-first.bash"
pictures=yes
while [ $# -gt 0 ]; do
  taken=1
  case "$1" in
    --no-pictures) pictures=no ;;
    *) build_option "$@" || refuse_option "$1" ;;
  esac
  shift "$taken"
done

exec </dev/null
cd "$root"
output=demo-output
mkdir -p "$output"

install_and_build build/logs/demo-build.log --target coronary-pipeline
pipeline="$root/build/paraview/bin/coronary-pipeline"

echo "== The beating phantom: 20 phases of gated CT, and the truth"
"$pipeline" phantom --seed 1 --phases 20 --spacing 0.5 --window 66 --noise 25 \
  --output "$output/phantom"

echo "== Its motion beside published values"
"$pipeline" phantom-motion --seed 1 | tee "$output/phantom-motion.txt"

echo "== From the images to the coronary arteries"
"$pipeline" run "$output/phantom/series.json" --tracked even --output "$output/run"

echo "== The run to look at: its vessels in the image"
"$pipeline" review "$output/run"

echo "== The model against the truth: Table 1, ours beside the paper's"
evaluate=("$pipeline" evaluate --result "$output/run" --truth "$output/phantom" --name "phantom 1"
  --output "$output/evaluation")
if [ "$pictures" = yes ]; then
  xvfb-run -a -s "-screen 0 1600x1000x24 -noreset" "${evaluate[@]}"
else
  "${evaluate[@]}" --no-pictures
fi
echo "   Look at it in a browser already: $output/evaluation/review.html"

echo "== The simulator and ParaView's plugin"
build_product build/logs/demo-build-rest.log

echo "== A guidewire in that model, driven by a script"
"$root/build/paraview/bin/coronary-simulator" --headless --scenario phantom-lca --vessels "$output/run" \
  --script "$root/Testing/Data/Driving/lad-apex.json" --output "$output/simulator" --output-rate 2 --write-wall

echo "== An angiogram of it"
"$root/build/paraview/bin/coronary-simulator" --headless --scenario phantom-lca --vessels "$output/run" \
  --script "$root/Testing/Data/Driving/lca-angiogram.json" --xray --output "$output/simulator/angiogram" --output-rate 10

if [ "$pictures" = yes ]; then
  echo "== Pictures"
  # A home of its own: the pictures must not depend on, nor change, the user's ParaView settings.
  home="$(mktemp -d)"
  trap 'rm -rf "$home"' EXIT
  render() {
    HOME="$home" XDG_CONFIG_HOME="$home" \
      xvfb-run -a -s "-screen 0 1600x1000x24 -noreset" pvpython "scripts/render-$1.py" "${@:2}" \
      --output "$output/pictures"
  }
  render phantom "$output/phantom"
  # The true surface of the phase that was segmented.
  phase="$(sed -n 's/^ *"phase": *\([0-9]*\).*/\1/p' "$output/run/report.json" | head -n 1)"
  truth="$output/phantom/truth/surface_$(printf %02d "$phase").vtp"
  render segmentation "$output/run" --truth "$truth"
  render centerline "$output/run" --truth "$truth"
  render surface "$output/run" --truth "$truth"
  render volume "$output/run"
  render skinning "$output/run"
  render tracking "$output/run"
  render simulator "$output/simulator"
  pvpython scripts/render-fluoroscopy.py "$output/simulator/angiogram" --seconds 0.35 0.7 1.0 1.6 3.9 4.6 5.4 6.4 \
    --shrink 2 --output "$output/pictures/angiogram.png"
fi

plugin="$(find "$root/build/paraview" -name DynamicCoronaryPlugin.so -print -quit)"
size() {
  du -sh "$1" | cut -f1
}
cat <<EOF

What lies where
  $output/phantom/phase_NN.mha        20 CT volumes, -5 % to 106 % of the R-R interval ($(size "$output/phantom"))
  $output/phantom/series.json         phases, R-R fractions, cycle length, ostia
  $output/phantom/truth/              surface, centerlines and vein of every phase (.vtp, .pvd)
  $output/run/                        vesselness, mask of the arteries, ostia, aorta and the
                                      named trees of centerlines at the quietest phase, their
                                      closed surface with its caps, skeleton, tetrahedra
                                      with the skeleton inside and their skin weights;
                                      motion/ has all of it at every phase (.series);
                                      status.csv and report.json say how they came about;
                                      review/review.html: its vessels in the image, straightened and in slabs
  $output/simulator/                  trajectory.pvd, forces.csv, tip.csv, statistics.json: a session of the simulator;
                                      angiogram/: X-ray frames of an injection
  $output/evaluation/                 review.html (the beating model, tables, plots, pictures),
                                      table1.csv, .json and .tex, branches.csv, pictures/, plots/
  $output/phantom-motion.txt          amplitudes, speeds and rest windows per artery
EOF
if [ "$pictures" = yes ]; then
  echo "  $output/pictures/                   $(find "$output/pictures" -name '*.png' | wc -l) pictures"
fi
cat <<EOF
  ${plugin#"$root/"}
                                      the ParaView plugin
Look at it, and press play:
  PV_PLUGIN_CONFIG_FILE=${plugin%/*/*}/dynamiccoronary.plugins.xml paraview --state=Plugin/states/result.py
EOF
