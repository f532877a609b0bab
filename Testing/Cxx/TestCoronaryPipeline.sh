#!/bin/sh
# Runs the program as a user does. Usage: TestCoronaryPipeline.sh PROGRAM CASE
set -u

program=$1
case=$2
work=$(mktemp -d "${TMPDIR:-/tmp}/coronary-pipeline-test.XXXXXX")
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1
failures=0

fail() {
  echo "FAILED: $*"
  failures=$((failures + 1))
}

# run EXPECTED-CODE ARGUMENTS...: leaves what was printed in ./stdout and ./stderr.
run() {
  expected=$1
  shift
  "$program" "$@" >stdout 2>stderr
  code=$?
  if [ "$code" -ne "$expected" ]; then
    fail "'$*': exit code $code instead of $expected"
    cat stdout stderr
  fi
}

# A failing run says why in one line that begins like $1 and has $2 in it.
expect_one_line() {
  if [ "$(grep -cv '^Warning: ' stderr)" -ne 1 ] || ! grep -q "^$1: " stderr || ! grep -qe "$2" stderr; then
    fail "not one line '$1: ... $2 ...' but:"
    cat stderr
  fi
}

expect_text() {
  grep -qaF -e "$2" "$1" || fail "'$2' is not in $1"
}

expect_nothing_in() {
  if [ -e "$1" ] && [ -n "$(ls -A "$1")" ]; then
    fail "left in $1:"
    ls -lRA "$1"
  fi
}

# An image of few voxels, of which some are in the vessels.
small="--quiet --spacing 3 --window 0 --origin -40 -40 -40 --dimensions 20 20 20"
coarse="--surface-spacing 1.5 --centerline-spacing 3"

check_metrics() {
  # shellcheck disable=SC2086
  run 0 phantom --seed 5 --phases 2 $small $coarse --output made
  a=made/truth/surface_00.vtp
  b=made/truth/surface_01.vtp
  run 0 metrics $a $b --json
  for key in HD HD_AB HD_BA HD95 MSD MSD_area RMS error_bound seconds; do
    grep -Eq "\"$key\": [0-9]" stdout || fail "no number $key in: $(cat stdout)"
  done
  expect_text stdout '"branches"'
  run 0 metrics $a $a
  grep -Eq '^HD +0\.00000$' stdout || fail "a surface is not at 0 from itself: $(cat stdout)"
  run 0 convert $a a.obj
  run 0 metrics a.obj $a --clip-ends
  grep -Eq '^HD +0\.00000$' stdout || fail "the same as .obj: $(cat stdout)"

  run 2 metrics $a
  printf 'solid one\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n' >one.stl
  printf 'ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n' >two.ply
  printf 'element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 2\n1 0 2\n0 1 2\n3 0 1 2\n' >>two.ply
  run 0 metrics one.stl two.ply
  grep -Eq '^HD +2\.00000$' stdout || fail "not 2 mm apart: $(cat stdout)"
  run 2 metrics $a b.txt
  expect_one_line "coronary-pipeline metrics" "'b.txt' does not"
  run 1 metrics $a nowhere.vtp
  expect_one_line "coronary-pipeline metrics" "nowhere.vtp"
  printf 'v 0 0 0\n' >empty.obj
  run 1 metrics empty.obj $a
  expect_one_line "coronary-pipeline metrics" "'empty.obj' has no triangles"
  run 1 metrics $a made/truth/centerline_00.vtp --json
  expect_one_line "coronary-pipeline metrics" "no triangles"
  printf 'v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n' >nan.obj
  run 1 metrics nan.obj $a
  expect_one_line "coronary-pipeline metrics" "nan.obj"
  run 2 metrics $a $b --error-bound 0
  expect_one_line "coronary-pipeline metrics" "--error-bound"
  printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\n' >one.obj
  sed 's/ 1/ 100/g;s/^f 100/f 1/' one.obj >large.obj
  run 0 metrics one.obj large.obj
  expect_text stderr "100 times"
}

check_evaluate() {
  # shellcheck disable=SC2086
  run 0 phantom --seed 5 --phases 3 --truth-only --quiet $coarse --output truth
  grep -q 'Name="Measured"' truth/truth/aorta_wall_01.vtp || fail "no true wall of the aorta"
  grep -q 'Name="Measured"' truth/truth/aorta_centerline_01.vtp || fail "no true axis of the aorta"
  # The truth as a result of its own: all distances are 0, all branches there.
  run 0 evaluate --result truth --truth truth --output itself
  for file in table1.csv table1.tex table1.json branches.csv review.html plots/HD.svg; do
    [ -s itself/$file ] || fail "no itself/$file"
  done
  for key in HD HD95 MSD ASSD centerline_mean; do
    [ "$(grep -c "\"$key\": \(0.0\|[0-9.]*e-1[0-9]\),*$" itself/table1.json)" -ge 6 ] || fail "$key is not 0 everywhere"
  done
  for key in found found_0.5 found_1.0 BCR BCS BCR_bounded; do
    [ "$(grep -c "\"$key\": \(1.0,*$\|0.9999999\|1.0000000\)" itself/table1.json)" -ge 6 ] \
      || fail "$key is not 1 everywhere"
  done
  [ "$(grep -c '"interpolated": true' itself/table1.json)" -eq 1 ] || fail "not every other phase"
  expect_text stdout "4.96  1.78  1.82  0.84"
  expect_text stderr "does not say which phases were tracked"

  # Another heart, two cases, of which one lacks a phase.
  # shellcheck disable=SC2086
  run 0 phantom --seed 6 --phases 3 --truth-only --quiet $coarse --output other
  mkdir fewer
  sed '/file="surface_01/d' other/truth/surface.pvd >fewer/surface.pvd
  cp other/truth/surface_0[02].vtp fewer
  run 0 evaluate --result other --truth truth --result fewer --truth truth --name one --name two \
    --interpolated none --output both --quiet
  grep -q '"HD": [1-9]' both/table1.json || fail "two hearts are the same"
  [ "$(grep -c '"phase": ' both/table1.json)" -eq 5 ] || fail "not 3 + 2 phases"
  expect_text stderr "these phases are left out"
  expect_text both/table1.csv 'A,"two",2,'

  run 2 evaluate --result truth --truth truth --truth other --output out
  expect_one_line "coronary-pipeline evaluate" "--result and --truth"
  run 1 evaluate --result nowhere --truth truth --output out
  expect_one_line "coronary-pipeline evaluate" "'nowhere' does not exist"
  mkdir empty
  run 1 evaluate --result empty --truth truth --output out
  expect_one_line "coronary-pipeline evaluate" "'empty' has no list of surfaces"
  printf '{"phase": 1}' >empty/report.json
  run 1 evaluate --result empty --truth truth --output out
  expect_one_line "coronary-pipeline evaluate" "'empty' is a run without motion"
  rm fewer/surface_02.vtp
  run 1 evaluate --result fewer --truth truth --output out
  expect_one_line "coronary-pipeline evaluate" "surface_02.vtp' is missing"
  sed 's/timestep="-*/timestep="7/' other/truth/surface.pvd >other/truth/late.pvd
  run 1 evaluate --result other/truth/late.pvd --truth truth --output out
  expect_one_line "coronary-pipeline evaluate" "No time of 'other/truth/late.pvd'"
  expect_nothing_in out
}

check_convert() {
  # shellcheck disable=SC2086
  run 0 phantom --seed 5 --phases 1 $small $coarse --output made
  tree=made/truth/centerline_00.vtp
  run 0 convert $tree lines.vtp
  expect_text lines.vtp CenterlineIds
  run 0 convert lines.vtp back.vtp
  expect_text back.vtp ParentGroupIds
  run 0 convert $tree tree.tgf
  run 0 convert lines.vtp lines.tgf
  run 0 convert back.vtp back.tgf
  # The same joints in the same order, whichever way they went.
  cmp lines.tgf back.tgf || fail "the tree did not come back from VMTK's lines"
  run 0 convert tree.tgf skeleton.vtp --radius 0.5
  run 0 convert skeleton.vtp again.tgf
  run 0 convert tree.tgf bones.vtp --form skeleton
  run 0 convert bones.vtp bones.tgf
  cmp tree.tgf bones.tgf || fail "bones have changed"
  run 2 convert $tree out.vtp --form skeleton
  expect_one_line "coronary-pipeline convert" "--form"
  # The joints may be numbered in another order.
  for file in tree again; do
    awk 'NF == 4 { print $2, $3, $4 } NF == 2 { ++bones } END { print bones }' "$file.tgf" |
      sort >"$file.joints"
  done
  cmp tree.joints again.joints || fail "the skeleton did not come back"
  cp tree.tgf kept.tgf

  run 2 convert $tree out.stl
  expect_one_line "coronary-pipeline convert" "out.stl"
  run 2 convert $tree out.tgf --form tree
  expect_one_line "coronary-pipeline convert" "--form"
  run 1 convert missing.vtp out.vtp
  expect_one_line "coronary-pipeline convert" "missing.vtp"
  printf '1 0 0 0\n2 1 0 0\n#\n1 3\n' >bad.tgf
  run 1 convert bad.tgf out.vtp
  expect_one_line "coronary-pipeline convert" "bad.tgf"
  run 1 convert made/truth/surface_00.vtp tree.tgf
  expect_one_line "coronary-pipeline convert" "surface_00.vtp"

  # Meshes go round through every format, and come back to the same numbers.
  run 0 convert made/truth/surface_00.vtp surface.obj
  run 0 convert surface.obj surface.off
  run 0 convert surface.off surface.mesh
  run 0 convert surface.mesh surface.vtp
  run 0 convert surface.vtp again.obj
  cmp surface.obj again.obj || fail "the surface did not come back"
  printf 'MeshVersionFormatted 2\nDimension 3\nVertices 4\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 0.1 0\nTetrahedra 1\n1 2 3 4 0\nEnd\n' >one.mesh
  run 0 convert one.mesh one.vtu
  run 0 convert one.vtu two.mesh
  grep -q '^1 2 3 4 0$' two.mesh || fail "the tetrahedron did not come back"
  run 1 convert one.mesh out.vtp
  expect_one_line "coronary-pipeline convert" "one.mesh"
  run 0 convert $tree radius.dmat --array MaximumInscribedSphereRadius
  run 0 convert radius.dmat binary.dmat --binary
  run 0 convert binary.dmat text.dmat
  cmp radius.dmat text.dmat || fail "the matrix did not come back"
  run 1 convert $tree out.dmat --array Nothing
  expect_one_line "coronary-pipeline convert" "Nothing"
  run 2 convert one.mesh out.dmat
  expect_one_line "coronary-pipeline convert" "one.mesh"
  printf '2 2\n1\n2\n' >bad.dmat
  run 1 convert bad.dmat out.dmat
  expect_one_line "coronary-pipeline convert" "bad.dmat"
  [ ! -e out.dmat ] || fail "out.dmat appeared"
  cmp tree.tgf kept.tgf || fail "a failed conversion changed its output"
  [ ! -e out.vtp ] || fail "out.vtp appeared"
}

check_files() {
  # shellcheck disable=SC2086
  run 0 phantom --seed 5 --fractions -0.05,0.35 --lost 2:0.5 $small $coarse --output made/here
  for number in 00 01; do
    for file in "phase_$number.mha" "truth/surface_$number.vtp" "truth/centerline_$number.vtp" \
      "truth/vein_$number.vtp"; do
      [ -s "made/here/$file" ] || fail "no $file"
    done
  done
  # Of the aorta the image has the beginning in the first phase only.
  for file in aorta_wall aorta_centerline; do
    [ -s "made/here/truth/${file}_00.vtp" ] || fail "no $file"
  done
  [ "$(find made -type f | wc -l)" -eq 14 ] || fail "other files than expected: $(find made)"
  [ -z "$(find made -name '.*')" ] || fail "hidden files are left: $(find made)"

  for text in '"cycle_ms": 800.0' '"fraction": -0.05' '"fraction": 0.35' '"image": "phase_01.mha"' \
    '"surface": "truth/surface_01.vtp"' '"centerline": "truth/centerline_00.vtp"' \
    '"name": "LCA"' '"name": "RCA"' '"position"'; do
    expect_text made/here/series.json "$text"
  done
  expect_text made/here/truth/surface.pvd 'timestep="0.35" group="" part="0" file="surface_01.vtp"'
  expect_text made/here/phase_00.mha "DimSize = 20 20 20"
  expect_text made/here/phase_00.mha "Offset = -40 -40 -40"
  for array in MaximumInscribedSphereRadius Abscissas SegmentIds Displacement Velocity GroupIds \
    ParentGroupIds TreeIds BranchGeneration StrahlerOrder SegmentLabel Length Tortuosity \
    CycleLength PhaseTime; do
    expect_text made/here/truth/centerline_01.vtp "Name=\"$array\""
  done
  for array in GroupIds Abscissas Displacement Velocity CellEntityIds CycleLength PhaseTime; do
    expect_text made/here/truth/surface_01.vtp "Name=\"$array\""
  done

  # The same bits again, with another number of threads and over the old files.
  cp -r made/here first
  # shellcheck disable=SC2086
  run 0 phantom --seed 5 --fractions -0.05,0.35 --lost 2:0.5 $small $coarse --threads 1 \
    --output made/here/
  diff -r first made/here || fail "a second run gave other files"

  # shellcheck disable=SC2086
  run 0 phantom --seed 6 --fractions -0.05,0.35 $small --no-truth --output other
  [ ! -e other/truth ] || fail "--no-truth wrote truth"
  cmp -s first/phase_00.mha other/phase_00.mha && fail "another seed gave the same image"

  # Compressed, turned and lying elsewhere; read again.
  # shellcheck disable=SC2086
  run 0 phantom --phases 3 $small --no-truth --compress --direction 0 1 0 -1 0 0 0 0 1 \
    --cycle-ms 1000 --output turned
  expect_text turned/phase_02.mha "CompressedData = True"
  expect_text turned/phase_02.mha "TransformMatrix = 0 -1 0 1 0 0 0 0 1"
  run 0 inspect --all turned/series.json
  expect_text stdout "Phases: 3, at R-R fractions -0.05 0.505 1.06"
  expect_text stdout "Cycle length: 1 s"
  expect_text stdout "Phase 3 (106.0 % R-R)"
}

check_scanner() {
  # Few and wide cells: the road, not the image.
  cat >scanner.json <<END
{ "preset": "single-350", "channels": 111, "channel_pitch_mm": 8.19, "rows": 8, "row_pitch_mm": 8.79,
  "views_per_turn": 120, "anatomy_spacing_mm": 4, "anatomy_step_s": 0.05, "extrasystole": 3 }
END
  image="--quiet --spacing 4 --fractions 0.4,0.75 --calcified-plaques 3 $coarse"
  # shellcheck disable=SC2086
  run 0 phantom --seed 5 $image --scanner scanner.json --output made
  for file in phase_00.mha phase_01.mha truth/surface_01.vtp scan.json series.json; do
    [ -s "made/$file" ] || fail "no $file"
  done
  [ "$(find made -type f | wc -l)" -eq 21 ] || fail "other files than expected: $(find made)"
  for text in '"channels": 111' '"kernel": "standard"' '"temporal_resolution_ms": 175.0' '"rr_ms": 480.0' '"half_scan_mAs"'; do
    expect_text made/scan.json "$text"
  done
  cmp -s made/phase_00.mha made/phase_01.mha && fail "two phases look the same"
  run 0 inspect made/series.json
  # shellcheck disable=SC2086
  run 0 phantom --seed 5 $image --scanner scanner.json --threads 1 --output again
  diff -r made again || fail "one thread gave other files"
  # shellcheck disable=SC2086
  run 0 phantom --seed 5 $image --scanner scanner.json --kernel sharp --no-truth --output sharp
  cmp -s made/phase_00.mha sharp/phase_00.mha && fail "another kernel gave the same image"

  # Several images of the same views; each is what it would be alone.
  # shellcheck disable=SC2086
  run 0 phantom --seed 5 $image --scanner scanner.json --kernel soft,sharp --image-noise 20,60 \
    --output several
  # shellcheck disable=SC2086
  run 0 phantom --seed 5 $image --scanner scanner.json --kernel soft --image-noise 60 --no-truth --output alone
  cmp several/soft-60/phase_01.mha alone/phase_01.mha || fail "several images are others than one alone"
  cmp -s several/soft-20/phase_01.mha alone/phase_01.mha && fail "more noise gave the same image"
  run 0 inspect --all several/sharp-20/series.json
  # The table moves, two beats share the angles; a scan that was stopped goes on.
  helical="phantom --seed 5 $image --scanner helical.json --no-truth"
  sed 's/"extrasystole": 3/"pitch": 0.15, "segments": 2, "iterative": 0.3/' scanner.json >helical.json
  # shellcheck disable=SC2086
  run 0 $helical --output helical
  expect_text helical/scan.json '"pitch": 0.15'
  # shellcheck disable=SC2086
  "$program" $helical --threads 1 --output stopped >/dev/null 2>&1 &
  job=$!
  until [ -n "$(find stopped -name '*.part' 2>/dev/null)" ] || ! kill -0 "$job" 2>/dev/null; do
    sleep 0.01
  done
  kill -INT "$job" 2>/dev/null || fail "the scan ended before it could be stopped"
  wait "$job"
  [ -d stopped/scan-parts ] || fail "no parts are left of a scan that was stopped"
  # shellcheck disable=SC2086
  run 0 ${helical#--quiet} --output stopped
  diff -r helical stopped || fail "a scan that went on gave other files"

  for bad in '--window 66' '--noise 3' '--lost 1' '--direction 1 0 0 0 1 0 0 0 1' '--truth-only'; do
    # shellcheck disable=SC2086
    run 2 phantom --scanner wide-280 $bad --output out
    expect_one_line "coronary-pipeline phantom" --scanner
  done
  run 2 phantom --kernel soft --output out
  expect_one_line "coronary-pipeline phantom" --kernel
  run 2 phantom --scanner nothing --output out
  expect_one_line "coronary-pipeline phantom" "single-350, single-330"
  while read -r reason json; do
    echo "$json" >bad.json
    run 1 phantom --scanner bad.json --spacing 4 --output out
    expect_one_line "coronary-pipeline phantom" "$reason"
  done <<END
object [1]
preset { "preset": 5 }
single-350 { "preset": "triple" }
not.known { "speed": 1 }
leaves.holes { "pitch": 1 }
number { "rows": "many" }
whole { "rows": 8.5 }
rows { "rows": 1000 }
kernel { "kernel": "hard" }
multiple.of.4 { "sources": 2, "views_per_turn": 985 }
fit.into.the.field { "channels": 400 }
half.scan.takes { "turn_s": 1.5 }
END
  [ ! -e out ] || fail "a folder was made for nothing"
}

# A tetrahedron of 40 mm, or what these triangles leave of it: off FILE TRIANGLE...
off() {
  file=$1
  shift
  printf 'OFF\n4 %d 0\n0 0 0\n40 0 0\n0 40 0\n0 0 40\n' $# >"$file"
  for triangle in "$@"; do
    echo "3 $triangle" >>"$file"
  done
}

check_scan() {
  # The phantom's own surfaces, in water.
  # shellcheck disable=SC2086
  run 0 phantom --seed 5 --quiet --truth-only $coarse --fractions 0,0.25,0.5,0.75 --output heart
  cat >scanner.json <<END
{ "preset": "single-350", "channels": 111, "channel_pitch_mm": 8.19, "rows": 8, "row_pitch_mm": 8.79,
  "views_per_turn": 120, "anatomy_spacing_mm": 4, "anatomy_step_s": 0.05 }
END
  cat >anatomy.json <<END
{ "cycle_ms": 900, "trunk": { "material": "water", "width_mm": 260, "depth_mm": 220 },
  "parts": [
    { "name": "lumen", "material": "blood", "value": 20, "unit": "mg/mL", "surfaces": "heart/truth/surface.pvd",
      "truth": true } ] }
END
  image="--scanner scanner.json --spacing 4 --fractions 0.25,0.4"
  # shellcheck disable=SC2086
  run 0 scan anatomy.json $image --output made
  expect_text stdout "1 part, 2 phases of"
  for file in phase_00.mha phase_01.mha truth/surface_01.vtp truth/surface.pvd scan.json series.json; do
    [ -s "made/$file" ] || fail "no $file"
  done
  [ "$(find made -type f | wc -l)" -eq 7 ] || fail "other files than expected: $(find made)"
  expect_text made/series.json '"cycle_ms": 900.0'
  expect_text made/series.json '"surface": "truth/surface_01.vtp"'
  run 0 inspect --all made/series.json
  # Where a surface is given the truth is that one, elsewhere it is between two.
  run 0 metrics made/truth/surface_00.vtp heart/truth/surface_01.vtp --json
  grep -Eq '"HD": ([0-9.]*e-|0\.0,|0\.000)' stdout || fail "another truth than what was scanned: $(cat stdout)"
  run 0 metrics made/truth/surface_01.vtp heart/truth/surface_01.vtp --json
  grep -Eq '"HD": [1-9]' stdout || fail "the truth does not move: $(cat stdout)"
  cmp -s made/phase_00.mha made/phase_01.mha && fail "two phases look the same"
  # shellcheck disable=SC2086
  run 0 scan anatomy.json $image --quiet --threads 1 --kernel soft,standard --no-truth --output several
  cmp made/phase_01.mha several/standard-25/phase_01.mha || fail "several images are others than one alone"
  expect_text several/soft-25/series.json phase_01.mha
  [ ! -e several/truth ] || fail "there is a truth"

  # A still part, the usual trunk.
  off solid.off "0 2 1" "0 1 3" "0 3 2" "1 2 3"
  off open.off "0 2 1" "0 1 3" "0 3 2"
  off other.off "0 2 1" "0 1 3" "0 3 2" "2 3 1"
  echo '{ "cycle_ms": 900, "parts": [ { "name": "bone", "material": "bone", "surfaces": ["solid.off"], "still": true } ] }' >bone.json
  run 0 scan bone.json --scanner scanner.json --spacing 5 --fractions 0.5 --output bone
  expect_text stdout "no trunk: an ellipse of soft tissue"
  [ ! -e bone/truth ] || fail "there is a truth"

  run 1 scan bone.json --scanner scanner.json --origin 100 0 0 --dimensions 9 9 9 --output out
  expect_one_line "coronary-pipeline scan" "bone.json.: nothing is in the image: along x"
  run 2 scan bone.json --output out
  expect_one_line "coronary-pipeline scan" --scanner
  run 1 scan none.json --scanner single-350 --output out
  expect_one_line "coronary-pipeline scan" none.json
  while read -r reason part; do
    echo "{ \"cycle_ms\": 900, \"parts\": [ { \"name\": \"a\", $part } ] }" >bad.json
    run 1 scan bad.json --scanner scanner.json --output out
    expect_one_line "coronary-pipeline scan" "bad.json.: part 'a'.*$reason"
  done <<END
is.open "material": "fat", "surfaces": "open.off"
other.off "material": "fat", "surfaces": ["solid.off", "other.off"], "phases": [0, 0.5]
2.surfaces.and.0.phases "material": "fat", "surfaces": ["solid.off", "solid.off"]
0.001 "material": "fat", "surfaces": ["solid.off", "solid.off"], "phases": [0, 1]
material.'gold' "material": "gold", "surfaces": "solid.off"
no.material "surfaces": "solid.off"
unit "material": "fat", "unit": "mg/mL", "value": 3, "surfaces": "solid.off"
no.surfaces "material": "fat"
gone.off "material": "fat", "surfaces": "gone.off"
scanner.json "material": "fat", "surfaces": "scanner.json"
colour "material": "fat", "surfaces": "solid.off", "colour": 1
END
  while read -r reason json; do
    echo "$json" >bad.json
    run 1 scan bad.json --scanner scanner.json --output out
    expect_one_line "coronary-pipeline scan" "bad.json.*$reason"
  done <<END
JSON {
object []
cycle_ms {}
cycle_ms { "cycle_ms": 5 }
parts { "cycle_ms": 900 }
name { "cycle_ms": 900, "parts": [ {} ] }
width_mm { "cycle_ms": 900, "parts": [ {} ], "trunk": { "material": "fat" } }
END
  [ ! -e out ] || fail "a folder was made for nothing"
}

check_options() {
  run 0 --version
  run 0 --help
  for command in phantom phantom-motion scan inspect; do
    run 0 "$command" --help
    expect_text stdout "coronary-pipeline $command [OPTIONS]"
  done
  run 2
  expect_one_line coronary-pipeline command
  run 2 nonsense
  expect_one_line coronary-pipeline nonsense
  run 2 --nonsense
  expect_one_line coronary-pipeline --nonsense
  run 2 phantom
  expect_one_line "coronary-pipeline phantom" --output
  run 2 phantom --output ""
  expect_one_line "coronary-pipeline phantom" --output
  run 2 inspect
  expect_one_line "coronary-pipeline inspect" PATH
  run 2 phantom-motion --cycle-ms 10
  expect_one_line "coronary-pipeline phantom-motion" --cycle-ms
  run 2 inspect x --cycle-ms nan
  expect_one_line "coronary-pipeline inspect" --cycle-ms

  # One a line; the option comes first, and must be named in the message.
  while read -r option values; do
    # shellcheck disable=SC2086
    run 2 phantom --output out $option $values
    expect_one_line "coronary-pipeline phantom" "$option"
  done <<END
--seed -1
--seed 1.5
--seed nan
--seed 99999999999
--phases 0
--phases -3
--phases
--phases 3 --fractions 0.1
--fractions 0.5,0.2
--fractions 0.2,0.2
--fractions nan
--spacing 0
--spacing -1
--spacing nan
--spacing inf
--spacing 1 2
--spacing 1 2 3 4
--window -1
--window 500
--noise nan
--noise -nan
--noise -5
--point-spread 1 2
--cycle-ms 0
--cycle-ms nan
--dominance up
--calibre 0
--stenoses 2.5
--lost 21
--lost 0
--lost 3:2
--lost 3:nan
--lost 3:
--lost x
--origin 0 0 0
--origin 0 nan 0
--dimensions 4 4 4
--dimensions 0 1 1
--direction 1 0 0
--direction 1 0 0 0 1 0 0 0 0
--direction nan 0 0 0 1 0 0 0 1
--threads -1
--truth-only --no-truth
--nonsense
END
  expect_nothing_in out
}

check_failures() {
  # An older result, that no failing run may touch.
  # shellcheck disable=SC2086
  run 0 phantom --seed 1 --phases 2 $small --no-truth --output old
  cp -r old copy

  # A full disk: no file may grow beyond 4 kB.
  # shellcheck disable=SC2086
  (trap '' XFSZ && ulimit -f 8 && run 1 phantom --seed 2 --phases 2 $small --no-truth --output old \
    && exit "$failures") || fail "a full disk"
  expect_one_line "coronary-pipeline phantom" "'old/phase_00.mha'"
  diff -r copy old || fail "a run that failed changed older files"
  # shellcheck disable=SC2086
  (trap '' XFSZ && ulimit -f 8 && run 1 phantom --phases 1 $small $coarse --output new/deep \
    && exit "$failures") || fail "a full disk"
  expect_one_line "coronary-pipeline phantom" "'new/deep/truth/[a-z]*_00.vtp'"
  [ ! -e new ] || fail "the folder of a failed run is left: $(find new)"

  echo text >file
  # shellcheck disable=SC2086
  run 1 phantom --phases 1 $small --no-truth --output file
  expect_one_line "coronary-pipeline phantom" "'file'"
  # shellcheck disable=SC2086
  run 1 phantom --phases 1 $small --no-truth --output file/below
  expect_one_line "coronary-pipeline phantom" "'file/below'"
  [ "$(cat file)" = text ] || fail "a file was replaced by a folder"
  mkdir -p taken/phase_00.mha
  # shellcheck disable=SC2086
  run 1 phantom --phases 1 $small --no-truth --output taken
  expect_one_line "coronary-pipeline phantom" "'taken/phase_00.mha'"
  expect_nothing_in taken/phase_00.mha
  if [ "$(id -u)" -ne 0 ]; then
    mkdir locked && chmod a-w locked
    # shellcheck disable=SC2086
    run 1 phantom --phases 1 $small --no-truth --output locked
    expect_one_line "coronary-pipeline phantom" "'locked'"
  fi

  run 1 phantom-motion --json no/such/folder.json
  expect_one_line "coronary-pipeline phantom-motion" "'no/such/folder.json'"
  if [ -c /dev/full ]; then
    "$program" phantom-motion >/dev/full 2>stderr && fail "a full standard output was not noticed"
    expect_one_line coronary-pipeline "standard output"
  fi

  run 1 inspect missing.mha
  expect_one_line "coronary-pipeline inspect" "'missing.mha'"
  head -c 1000 old/phase_00.mha >cut.mha
  run 1 inspect cut.mha
  expect_one_line "coronary-pipeline inspect" "'cut.mha'"
  rm old/phase_01.mha
  run 1 inspect old/series.json
  expect_one_line "coronary-pipeline inspect" "phase_01.mha"
}

# interrupt SIGNAL EXPECTED-CODE SECONDS FOLDER: interrupts a run some time after it began to write.
interrupt() {
  "$program" phantom --seed 3 --phases 20 --spacing 1 --output "$4" >stdout 2>stderr &
  process=$!
  tries=0
  while [ -z "$(find "$4" -name '.unfinished-*' 2>/dev/null)" ] && [ $tries -lt 100 ]; do
    sleep 0.1
    tries=$((tries + 1))
  done
  sleep "$3"
  kill -s "$1" "$process"
  wait "$process"
  code=$?
  [ "$code" -eq "$2" ] || fail "SIG$1 after $3 s: exit code $code instead of $2"
  [ "$(tail -n 1 stderr)" = "coronary-pipeline phantom: interrupted" ] \
    || fail "SIG$1 after $3 s: $(cat stderr)"
}

check_interruption() {
  for seconds in 0 0.5 2; do
    interrupt INT 130 "$seconds" new/deep
    [ ! -e new ] || fail "left after $seconds s: $(find new)"
  done
  interrupt TERM 143 0 new
  [ ! -e new ] || fail "left after SIGTERM: $(find new)"

  # shellcheck disable=SC2086
  run 0 phantom --phases 2 $small --no-truth --output old
  cp -r old copy
  interrupt INT 130 1 old
  diff -r copy old || fail "an interrupted run changed older files"
}

check_progress() {
  # shellcheck disable=SC2086
  run 0 phantom --phases 2 $small --no-truth --output made
  if [ -s stdout ] || [ -s stderr ]; then
    fail "--quiet is not quiet: $(cat stdout stderr)"
  fi
  # shellcheck disable=SC2086
  run 0 phantom --phases 2 ${small#--quiet} --no-truth --output made
  expect_text stderr "phase 2 of 2 (106.0 % R-R)"
  expect_text stdout "made: 2 phases of 20 x 20 x 20 voxels of 3 x 3 x 3 mm, cycle 800 ms"
  if script -qec true /dev/null >/dev/null 2>&1; then
    script -qec "'$program' phantom --phases 2 ${small#--quiet} --no-truth --output made" \
      /dev/null >terminal </dev/null
    expect_text terminal "[############"
    expect_text terminal "phase 2 of 2"
  fi
}

check_motion() {
  # The mean anatomy moves as the published and recommended values say.
  run 0 phantom-motion --seed 0 --json motion.json
  for line in "LM  *amplitude" "LAD mid  *amplitude" "LCx  *amplitude" "RCA proximal to mid  *amplitude" \
    "proximal left tree (5 cm) *systolic rest" "proximal left tree (5 cm) *diastolic rest" \
    "RCA proximal to mid  *systolic rest" "RCA proximal to mid  *diastolic rest"; do
    grep -q "^$line.* within " stdout || fail "not within its range: $(grep "^$line" stdout)"
  done
  grep -q " outside " stdout && fail "outside: $(grep " outside " stdout)"
  expect_text motion.json '"diastolic_rest_ms"'
  expect_text motion.json '"within": true'

  # At another heart rate nothing is compared.
  run 0 phantom-motion --cycle-ms 1000
  grep -qE " (within|outside) " stdout && fail "compared at another heart rate"
}

# Files of two results, but for times and memory.
expect_same_results() {
  diff -rq -x report.json "$1" "$2" || fail "$3"
}

check_weights() {
  run 0 phantom --quiet --seed 2 --fractions 0.45,0.74 --spacing 1.2 --no-truth --output series
  options="--quiet --scales 0.7 2.5 --time 0.74 --edges 0.4 0.8 --motion tracked"
  # shellcheck disable=SC2086
  run 0 run --input series/series.json $options --threads 1 --weight-cache weights --output bound
  # In pieces, by another number of threads.
  for until in segmentation volume motion; do
    # shellcheck disable=SC2086
    run 0 run series/series.json $options --threads 2 --weight-cache weights2 --until $until --resume --output bound2
  done
  expect_same_results bound bound2 "another number of threads, or resuming, gave another result"
  diff -r weights weights2 || fail "another number of threads gave another cache"
  for file in surface.vtp caps.vtp volume.vtu volume_boundary.vtp volume_skeleton.vtp; do
    [ -s "bound/$file" ] || fail "no $file"
  done
  grep -q '"tetrahedra": [0-9]\{5,\}' bound/report.json || fail "few tetrahedra: $(cat bound/report.json)"
  for name in BoneIndices BoneWeightsCompact DroppedWeight BoneName WeightsResidual; do
    grep -q "Name=\"$name\"" bound/weights.vtu || fail "no $name in weights.vtu"
  done
  for name in ParentJoint BoneId GroupIds BoneName; do
    grep -q "Name=\"$name\"" bound/skeleton.vtp || fail "no $name in skeleton.vtp"
  done
  grep -q '"bones": [0-9]\{2,\}' bound/report.json || fail "few bones: $(cat bound/report.json)"
  # A column a bone, a row a point; the skeleton's graph has as many bones.
  bones=$(sed -n 's/.*"bones": \([0-9]*\).*/\1/p' bound/report.json)
  points=$(grep -o 'NumberOfPoints="[0-9]*"' bound/weights.vtu | tr -dc 0-9)
  [ "$(head -n 1 bound/weights.dmat)" = "$bones $points" ] || fail "weights.dmat: $(head -n 1 bound/weights.dmat)"
  [ "$(sed '1,/#/d' bound/skeleton.tgf | wc -l)" = "$bones" ] || fail "skeleton.tgf has not $bones bones"

  # Where no bone is outside, leaving those out changes nothing; the report says that none was.
  cp -r bound left
  # shellcheck disable=SC2086
  run 0 run series/series.json $options --until weights --leave-bones-outside --resume --output left
  grep -q '"left_out_bones": \[\]' left/report.json || fail "left_out_bones: $(cat left/report.json)"
  grep -q 'Name="LeftOutBones"' left/weights.vtu || fail "no LeftOutBones in weights.vtu"
  grep -q 'left_out_bones' bound/report.json && fail "left_out_bones without --leave-bones-outside"
  cmp -s bound/skeleton.vtp left/skeleton.vtp || fail "--leave-bones-outside changed the skeleton"

  # The same mesh at every phase, moved.
  for name in centerline.vtp skeleton.vtp surface.vtp volume.vtu; do
    [ "$(grep -c '"time": 0\.[47]' "bound/motion/$name.series")" = 2 ] \
      || fail "$name.series: $(cat "bound/motion/$name.series")"
    [ "$(grep -c 'timestep="0\.[47]' "bound/motion/${name%.*}.pvd")" = 2 ] \
      || fail "${name%.*}.pvd: $(cat "bound/motion/${name%.*}.pvd")"
    [ "$(grep -o 'NumberOfPoints="[0-9]*"' "bound/motion/${name%.*}_00.${name##*.}")" = \
      "$(grep -o 'NumberOfPoints="[0-9]*"' "bound/motion/${name%.*}_01.${name##*.}")" ] \
      || fail "$name has other points at another phase"
    cmp -s "bound/motion/${name%.*}_00.${name##*.}" "bound/motion/${name%.*}_01.${name##*.}" \
      && fail "$name does not move"
  done
  grep -q 'timestep="0.45".*file="motion/surface_00.vtp"' bound/motion.pvd || fail "motion.pvd: $(cat bound/motion.pvd)"
  grep -q 'timestep="0.74".*file="motion/surface_01.vtp"' bound/motion.pvd || fail "motion.pvd: $(cat bound/motion.pvd)"
  for name in PlacementConfidence TrackingConfidence TrackingStatus CalibreFactor AxialStrain TrackedShare; do
    grep -q "Name=\"$name\"" bound/motion/centerline_00.vtp || fail "no $name in centerline_00.vtp"
  done
  expect_text bound/report.json '"tracked_share"'
  expect_text bound/report.json '"placement"'
  expect_text bound/report.json '"filled"'
  expect_text bound/report.json '"objective_after_mm2"'
  expect_text bound/motion/mesh.json '"inlet_'

  # The beating result for viewers; 125: the validator can not be had.
  run 0 sequence bound --formats gltf --quiet --output exported
  "${0%/*}/../../scripts/gltf-validator.sh" exported/mesh_skin.glb >found 2>&1
  code=$?
  cat found
  [ "$code" = 0 ] || [ "$code" = 125 ] || fail "the Khronos validator ends with $code"
  [ ! -e bound/motion/volume_02.vtu ] || fail "a third phase"

  # A shorter sequence takes the place of a longer one, and of nothing else; only the motion is made anew.
  touch bound/motion/volume_extra.txt
  before=$(cat bound/*.vt? bound/*.mha | cksum)
  # shellcheck disable=SC2086
  run 0 run series/series.json ${options#--quiet} --resume --moments 0.5 --output bound
  expect_text stderr "from stage motion on: 'moments' was [] and is [0.5]"
  expect_text stderr "stage 1 of 1 (motion)"
  [ "$before" = "$(cat bound/*.vt? bound/*.mha | cksum)" ] || fail "resuming changed the stages before"
  for name in centerline_01.vtp skeleton_01.vtp surface_01.vtp volume_01.vtu; do
    [ ! -e "bound/motion/$name" ] || fail "$name of the longer sequence is left"
  done
  for name in centerline_00.vtp volume_00.vtu volume_extra.txt; do
    [ -e "bound/motion/$name" ] || fail "$name is gone"
  done
  rm -f bound/weights.vtu
  # shellcheck disable=SC2086
  run 0 run series/series.json ${options#--quiet} --resume --until weights --weight-cache weights --output bound
  expect_text stderr "from stage weights on: 'weights.vtu' is not there"
  # The motion was of weights that have been made anew: it is gone.
  [ ! -e bound/motion.pvd ] || fail "motion of older weights is left"
  [ "$(find bound/motion -type f)" = bound/motion/volume_extra.txt ] || fail "left: $(ls bound/motion)"
  touch -d 2001-01-01 series/phase_00.mha
  # shellcheck disable=SC2086
  run 0 run series/series.json ${options#--quiet} --resume --until vesselness --output bound
  expect_text stderr "from stage vesselness on: the result is of another input"
  [ "$(find bound -type f | sort | tr '\n' ' ')" = \
    "bound/motion/volume_extra.txt bound/report.json bound/vesselness.mha " ] || fail "left: $(find bound)"

  # One phase beats as a population does, and every product says so.
  run 0 run series/phase_01.mha --quiet --scales 0.7 2.5 --edges 0.8 1.6 --heart-rate 60 --output beating
  expect_text stderr "Warning: motion not of this patient: the mean of a population, at 60 beats a minute (one phase only)"
  expect_text beating/report.json '"motion": "population"'
  expect_text beating/report.json '"statement": "motion not of this patient'
  expect_text beating/report.json '"phases": 1'
  expect_text beating/report.json 'atrioventricular groove:'
  [ "$(grep -c '"time"' beating/motion/skeleton.vtp.series)" = 20 ] || fail "$(cat beating/motion/skeleton.vtp.series)"
  for name in MotionSource MotionDeviation PlacementConfidence TrackingConfidence; do
    grep -q "Name=\"$name\"" beating/motion/centerline_00.vtp || fail "no $name in centerline_00.vtp"
  done
  grep -q 'Name="MotionSource"' beating/motion/surface_00.vtp || fail "no MotionSource in surface_00.vtp"
  cmp -s beating/motion/surface_00.vtp beating/motion/surface_08.vtp && fail "nothing moves"
  run 0 review beating --no-pictures --quiet --output page
  expect_text page/review.html "motion not of this patient"
  # A population needs names.
  run 0 run series/phase_01.mha --quiet --scales 0.7 2.5 --edges 0.8 1.6 --heart-rate 60 --no-labels --output nameless
  expect_text stderr "motion is not possible: one phase only, and no population's motion"
  run 1 run series/phase_01.mha --quiet --scales 0.7 2.5 --edges 0.8 1.6 --heart-rate 60 --no-labels --motion population \
    --resume --output nameless
  expect_text stderr "HeartFrame"

  # Or it rests.
  cp -r beating still
  run 0 run series/phase_01.mha --quiet --scales 0.7 2.5 --edges 0.8 1.6 --heart-rate 60 --motion none --resume --output still
  expect_text stderr "Warning: motion is not possible: --motion none"
  expect_text still/report.json '"motion": "none"'
  [ -s still/weights.vtu ] || fail "no static model: $(ls still)"
  expect_text still/report.json '"at_rest": true'
  [ -s still/motion.pvd ] || fail "no model at rest: $(ls still)"
  for kind in centerline.vtp skeleton.vtp surface.vtp volume.vtu; do
    [ -s "still/motion/$kind.series" ] || fail "no $kind.series: $(ls still/motion)"
  done
  for kind in skeleton surface; do
    for phase in 00 01; do
      # The points; the moment is another one.
      sed -n '/<Points>/,/<\/Points>/p' "still/motion/${kind}_$phase.vtp" >"places_$phase"
    done
    [ -s places_00 ] || fail "no points in $kind"
    cmp places_00 places_01 || fail "$kind does not rest"
  done

  # A mask alone: the same trees, without an image.
  run 2 run --mask still/mask.mha --until vesselness --output masked
  expect_one_line "coronary-pipeline run" "a mask has no images"
  run 0 run --mask still/mask.mha --quiet --edges 0.8 1.6 --output masked
  expect_text stderr "has no aorta: trees begin at their widest ends"
  expect_text stderr "motion not of this patient: the mean of a population, at 75 beats a minute (a mask has no images to track)"
  [ -s masked/motion.pvd ] || fail "no model of a mask: $(ls masked)"
  [ "$(grep -c . masked/status.csv)" -ge 3 ] || fail "trees of a mask: $(cat masked/status.csv)"

  # A tree that is lost ends the run, or is left out by name.
  ostium=$(sed -n 2p still/status.csv | cut -d, -f2-4 | tr , ' ')
  corner=$(grep -a '^Offset = ' still/mask.mha | cut -d' ' -f3-5) # of the image, where no vessel is
  options="--quiet --scales 0.7 2.5 --until centerline --seed $ostium --seed $corner --output lost"
  # shellcheck disable=SC2086
  run 1 run series/phase_01.mha $options
  expect_text stderr "the tree of seed 1 is lost"
  expect_text stderr "--partial"
  [ -s lost/centerline.vtp ] || fail "nothing to look at: $(ls lost)"
  # shellcheck disable=SC2086
  run 1 run series/phase_01.mha $options --resume
  expect_text stderr "the tree of seed 1 is lost"
  # shellcheck disable=SC2086
  run 0 run series/phase_01.mha $options --resume --partial
  expect_text stderr "Warning: the tree of seed 1 is lost"
}

check_settings() {
  run 0 run --print-settings series.json --output result --seed 1 2 3 --seed 4 5 6.25 --scales 0.75 2.5 --no-labels \
    --tracked even --moments 0.1,0.30000000000000004 --threads 3
  mv stdout settings.json
  run 0 run --print-settings --settings settings.json
  cmp stdout settings.json || fail "the settings are not what was printed"
  # The command line counts more, for what it names.
  run 0 run --print-settings --settings settings.json --tracked all --seed 7 8 9
  diff stdout settings.json | grep -q '"tracked": "all"' || fail "--tracked does not count more"
  [ "$(grep -c '^ *[0-9.]*,\{0,1\}$' settings.json)" -gt "$(grep -c '^ *[0-9.]*,\{0,1\}$' stdout)" ] || fail "--seed adds to the file's"
  run 0 run --print-settings
  expect_text stdout '"until": "motion"'

  for wrong in '{ "scals": [1, 2] }/scals' '{ "scales": [1] }/scales' '{ "c": "much" }/c' '{ "labels": 1 }/labels' \
    '{ "threads": 1.5 }/threads' '{ "until": "nowhere" }/until' '{ "seed": [1, 2, 3] }/seed' \
    '{ "largest_radius": 0 }/largest_radius' '{ "time": [] }/time'; do
    echo "${wrong%/*}" >wrong.json
    run 1 run --settings wrong.json --print-settings
    expect_one_line "coronary-pipeline run" "'wrong.json': '${wrong##*/}'"
  done
  echo '{ "c": 1' >wrong.json
  run 1 run --settings wrong.json --print-settings
  expect_one_line "coronary-pipeline run" "'wrong.json' is not JSON"
  run 1 run --settings nowhere.json
  expect_one_line "coronary-pipeline run" "nowhere.json"
  run 2 run --settings settings.json --scales 3 1
  expect_one_line "coronary-pipeline run" "--scales"
  run 2 run --output result
  expect_one_line "coronary-pipeline run" "--input"
  run 2 run series.json
  expect_one_line "coronary-pipeline run" "--output"
  [ ! -e result ] || fail "a folder was made for nothing"
}

check_surface() {
  run 0 phantom --quiet --seed 2 --fractions 0.74 --truth-only --surface-spacing 0.8 --output made
  cp made/truth/surface_00.vtp given.vtp
  run 0 run given.vtp --edges 0.8 1.6 --output swept
  expect_text stderr "stage 1 of 5 (centerline)"
  expect_text stderr "motion not of this patient: the mean of a population, at 75 beats a minute (a surface has no images to track)"
  for file in given_surface.vtp centerline.vtp surface.vtp volume.vtu skeleton.tgf weights.dmat report.json; do
    [ -s "swept/$file" ] || fail "no $file: $(ls swept)"
  done
  [ ! -e swept/vesselness.mha ] || fail "a surface has no vesselness"
  grep -q '"branches": [0-9]\{2\}' swept/report.json || fail "few branches: $(cat swept/report.json)"
  run 0 metrics swept/surface.vtp given.vtp --json
  # The swept surface follows the given one, but for what is too short to be a branch.
  awk '/"MSD"/ { found = 1; if ($2 + 0 > 0.3) exit 1 } END { exit !found }' stdout || fail "far away: $(cat stdout)"

  run 0 convert given.vtp given.obj
  run 0 run given.obj --quiet --surface given --until surface --output given
  run 0 metrics given/surface.vtp given.vtp --json
  awk '/"HD"/ { found = 1; if ($2 + 0 > 0.1) exit 1 } END { exit !found }' stdout || fail "not the given one: $(cat stdout)"

  run 1 run nowhere.stl --output none
  expect_one_line "coronary-pipeline run" "nowhere.stl"
  run 1 run given.vtp given.obj --output none
  expect_one_line "coronary-pipeline run" "only input"
  run 1 run made/truth/centerline_00.vtp --quiet --output none
  expect_one_line "coronary-pipeline run" "centerline_00.vtp' has no triangles"
  run 2 run given.vtp --until segmentation --output none
  expect_one_line "coronary-pipeline run" "--until"
  # No seed in a vessel: said at the stage that can not go on.
  run 1 run given.vtp --quiet --seed 900 900 900 --output lost
  expect_one_line "coronary-pipeline run" "the tree of seed 0 is lost"
  expect_text lost/report.json '"stage": "centerline"'
  expect_nothing_in none
}

# Of both trees together.
branches_of() {
  sed -n 's/^    "branches": \([0-9]*\),*/\1/p' "$1/report.json"
}

check_run() {
  run 0 phantom --quiet --seed 2 --fractions 0.15,0.2,0.74,0.78 --spacing 1.2 --window 0 --no-truth --output series
  head -c 2000 series/phase_00.mha >series/cut.mha
  sed 's/phase_00/cut/' series/series.json >series/broken.json
  run 0 run series/series.json --scales 0.7 2.5 --until centerline --output result
  for file in vesselness.mha mask.mha ostia.vtp aorta.vtp aorta_wall.vtp aorta_centerline.vtp \
    centerline.vtp bifurcations.vtp \
    centerline_lines.vtp status.csv lesions.csv report.json; do
    [ -s "result/$file" ] || fail "no $file"
  done
  for name in Measured AortaSource AortaLengths; do
    grep -q "Name=\"$name\"" result/aorta_wall.vtp || fail "no $name in aorta_wall.vtp"
    grep -q "Name=\"$name\"" result/aorta_centerline.vtp || fail "no $name in aorta_centerline.vtp"
  done
  grep -q '"source": "measured: [1-9][0-9]* mm from the valve to the image' result/report.json \
    || fail "the report does not tell of the aorta"
  expect_text stdout "LCA at"
  expect_text stdout "RCA at"
  expect_text stderr "stage 3 of 4 (segmentation)"
  expect_text stderr "stage 4 of 4 (centerline)"
  expect_text stdout " branches, "
  grep -q '"complete": true' result/report.json || fail "the trees are not complete"
  [ "$(grep -cE '^"(LCA|RCA)",.*,0,"reached",[0-9]+,[0-9.]+$' result/status.csv)" = 2 ] \
    || fail "status.csv: $(cat result/status.csv)"
  [ "$(head -c 12 result/lesions.csv)" = "vessel,x_mm," ] || fail "lesions.csv: $(cat result/lesions.csv)"
  for name in SegmentLabel MaximumInscribedSphereRadius Confidence SeedStatus Dominance \
    StenosisDegree ReferenceRadius RadiusInterpolated CalciumLabel; do
    grep -q "Name=\"$name\"" result/centerline.vtp || fail "no $name in centerline.vtp"
  done
  for name in CenterlineIds TractIds GroupIds Blanking; do
    grep -q "Name=\"$name\"" result/centerline_lines.vtp || fail "no $name in centerline_lines.vtp"
  done
  grep -q '"name": "RCA"' result/report.json || fail "no RCA in the report"
  grep -q '"phase": [23],' result/report.json || fail "not a quiet phase: $(grep phase result/report.json)"

  run 0 run series/series.json --quiet --until segmentation --scales 0.7 2.5 --output mask
  if [ ! -s mask/mask.mha ] || [ -e mask/centerline.vtp ]; then
    fail "--until segmentation wrote $(ls mask)"
  fi
  run 0 run series/series.json --quiet --beyond-mask --scales 0.7 2.5 --until centerline \
    --output beyond
  [ "$(branches_of beyond)" -gt "$(branches_of result)" ] || fail "beyond the mask are no more branches"

  run 0 run series/series.json --quiet --until vesselness --scales 0.7 2.5 --time 0.1 --output enhanced
  if [ -s stdout ] || [ -s stderr ]; then
    fail "--quiet is not quiet: $(cat stdout stderr)"
  fi
  [ "$(find enhanced -type f | sort | tr '\n' ' ')" = \
    "enhanced/report.json enhanced/vesselness.mha " ] || fail "$(find enhanced)"
  grep -q '"phase": 0,' enhanced/report.json || fail "not the phase that was asked for"

  # Wrong command lines, and a failure that leaves what was there.
  run 2 run series/series.json --until nowhere --output result
  expect_one_line "coronary-pipeline run" "--until"
  run 2 run series/series.json --scales 3 1 --output result
  expect_one_line "coronary-pipeline run" "--scales"
  run 2 run series/series.json --window 400 50 --output result
  expect_one_line "coronary-pipeline run" "--window"
  run 1 run nothing.json --quiet --output result
  expect_one_line "coronary-pipeline run" "nothing.json"
  before=$(cat result/*.mha result/*.vtp result/report.json | cksum)
  run 1 run series/broken.json --quiet --output result
  [ "$before" = "$(cat result/*.mha result/*.vtp result/report.json | cksum)" ] \
    || fail "a failed run changed its folder: $(ls -lA result)"
  # What is finished stays, of this run alone, and can be gone on from.
  run 1 run series/series.json --quiet --scales 0.7 2.5 --seed 9999 0 0 --output result
  expect_one_line "coronary-pipeline run" "Seed 0 is outside the image"
  expect_text result/report.json '"stage": "segmentation"'
  expect_text result/report.json 'Seed 0 is outside the image'
  [ "$(find result -type f | sort | tr '\n' ' ')" = "result/report.json result/vesselness.mha " ] \
    || fail "not the finished stage alone: $(find result)"
  run 0 run series/series.json --scales 0.7 2.5 --until centerline --resume --output result
  expect_text stderr "stage 1 of 2 (segmentation)"
  [ "$before" = "$(cat result/*.mha result/*.vtp result/report.json | cksum)" ] && fail "the report says nothing of resuming"
  expect_text result/report.json '"stopped": null'
  run 1 run series/broken.json --quiet --scales 0.7 2.5 --output new/result
  expect_nothing_in new
  [ -z "$(find result -name '.*')" ] || fail "hidden files are left: $(find result)"
}

check_libraries() {
  # Neither Python nor ParaView at run time, and nothing is missing.
  ldd "$program" >libraries
  grep -iE "python|libQt|pqCore|vtkRemoting|vtkPVServer|not found" libraries \
    && fail "the program needs libraries that it should not"
}

# Several processes, as mpirun starts them: as root, and more than there are cores.
on_ranks() {
  ranks=$1
  expected=$2
  shift 2
  OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 OMPI_MCA_rmaps_base_oversubscribe=1 \
    OMPI_MCA_btl_vader_single_copy_mechanism=none OMPI_MCA_orte_execute_quiet=1 OMPI_MCA_hwloc_base_binding_policy=none \
    timeout "${RANKS_TIMEOUT:-120}" mpirun -q -np "$ranks" "$program" "$@" >stdout 2>stderr
  code=$?
  sed -i '/^\[hwloc/d' stderr # where there is no /sys, Open MPI says so
  if [ "$code" -ne "$expected" ]; then
    fail "'$*' on $ranks ranks: exit code $code instead of $expected"
    cat stdout stderr
  fi
}

# The report of a run without what is different every time, and other folders' names.
plain_report() {
  sed -E 's/"(seconds|cpu_seconds|peak_memory_mb)": [0-9.e+-]*/"\1": 0/; s/"(run|started)": "[^"]*"/"\1": ""/;
    s/"output": "[^"]*"/"output": ""/' "$1/report.json"
}

# A small heart, of which the arteries are found without looking for them, with long edges and few branches.
moving="--quiet --phases 3 --spacing 1.5 --window 0 $coarse"
quick="--quiet --scales 0.75 2.5 --edges 0.8 1.5 --least-branch 40 --motion tracked --seed 0.13 0.25 0.33 --seed -19.87 -29.98 -15.7"

# From images to Table 1. Voxels are coarse, vessels narrower than two of them are not there; what is there is in its place at
# every phase.
check_road() {
  # shellcheck disable=SC2086
  run 0 phantom --seed 2 $moving --output series
  # shellcheck disable=SC2086
  run 0 run series/series.json $quick --output result
  run 0 evaluate --result result --truth series --interpolated none --no-pictures --quiet --output table
  # Columns: found_1.0, false_length_mm, MSD_mm.
  awk -F, '$1 == "A" && $3 ~ /^[0-9]+$/ { ++phases; if ($8 < 0.75 || $13 > 20 || $16 > 0.36) ++bad }
    END { exit phases != 3 || bad }' table/table1.csv || fail "not where it is: $(cat table/table1.csv)"
  expect_text result/report.json '"tracked_share"'
  [ "$(grep -c '"time"' result/motion/surface.vtp.series)" = 3 ] || fail "not all phases: $(ls result/motion)"
}

check_ranks() {
  command -v mpirun >/dev/null || exit 125
  # shellcheck disable=SC2086
  run 0 phantom --seed 2 $moving --output series
  for ranks in 1 3; do
    # shellcheck disable=SC2086
    on_ranks "$ranks" 0 run series/series.json $quick --threads 1 --output "run$ranks"
    on_ranks "$ranks" 0 sequence run1 --phases 3 --formats series,simvascular,vmtk,obj,gltf --velocity --quiet --output "sequence$ranks"
    on_ranks "$ranks" 0 evaluate --result run1 --truth series --no-pictures --quiet --output "table$ranks"
    plain_report "run$ranks" >"report$ranks"
  done
  expect_same_results run1 run3 "run on 3 ranks gives other files"
  diff report1 report3 || fail "run on 3 ranks gives another report"
  diff -rq sequence1 sequence3 || fail "sequence on 3 ranks gives other files"
  # The page tells where it was written to.
  sed -i 's/--output table[13]/--output table/' table1/review.html table3/review.html
  diff -rq table1 table3 || fail "evaluate on 3 ranks gives other files"
  [ "$(find run1/motion -name 'surface_0*.vtp' | wc -l)" = 3 ] || fail "not all phases: $(ls run1/motion)"
  [ "$(find sequence1 -name 'mesh_surface_*.obj' | wc -l)" = 3 ] || fail "not all phases: $(ls sequence1)"
  [ "$(grep -c '"interpolated"' table1/table1.json)" = 3 ] || fail "not all phases in the table"

  # The first rank alone speaks.
  on_ranks 2 0 run --print-settings x
  [ "$(grep -c '"until"' stdout)" = 1 ] || fail "not one rank printed: $(cat stdout)"
  on_ranks 2 2 run --no-such-option
  expect_one_line "coronary-pipeline run" "no-such-option"
  on_ranks 2 2 phantom --output other
  expect_one_line "coronary-pipeline phantom" "without mpirun"
}

check_ranks_failures() {
  command -v mpirun >/dev/null || exit 125
  # shellcheck disable=SC2086
  run 0 phantom --seed 2 $moving --compress --output series
  # A phase that only one of the ranks reads, whichever it is; the reference is the last one.
  for phase in 0 1; do
    cp -r series damaged
    printf damaged | dd of="damaged/phase_0$phase.mha" bs=1 seek=30000 conv=notrunc 2>dd.txt
    # shellcheck disable=SC2086
    on_ranks 2 1 run damaged/series.json $quick --time 1.06 --output broken
    expect_one_line "coronary-pipeline run" "phase_0$phase.mha"
    rm -r damaged
    [ -z "$(find broken -mindepth 1 -name '.*')" ] || fail "hidden files are left: $(find broken)"
    [ -s broken/weights.vtu ] || fail "what was finished did not stay: $(ls -A broken)"
    [ ! -e broken/motion ] || fail "a failed stage left files: $(ls -A broken/motion)"
  done
  cp -r series/truth truth
  head -c 500 truth/surface_01.vtp >cut.vtp
  mv cut.vtp truth/surface_01.vtp
  on_ranks 3 1 evaluate --result series --truth truth --no-pictures --quiet --output tables
  expect_one_line "coronary-pipeline evaluate" "surface_01.vtp"
  expect_nothing_in tables

  # One rank is asked to end: all do.
  # shellcheck disable=SC2086
  on_ranks 2 143 run series/series.json $quick --contours --output stopped &
  waiting=$!
  until_there stopped/weights.vtu
  kill -TERM "$(pgrep -f "^$program run series/series.json .*--output stopped" | tail -n 1)"
  wait "$waiting"
  grep -q "interrupted" stderr || fail "not interrupted: $(cat stderr)"
  [ ! -e stopped/motion ] || fail "an interrupted stage left files: $(ls -A stopped/motion)"
}

# Waits for a file that another process makes.
until_there() {
  for _ in $(seq 1200); do
    [ ! -e "$1" ] || return
    sleep 0.1
  done
  fail "no $1"
}

check_cohort() {
  # shellcheck disable=SC2086
  run 0 phantom --seed 2 $moving --output own/good
  cp -r own/good own/bad
  head -c 3000 own/good/phase_00.mha >own/bad/phase_00.mha
  cat >cases.json <<'JSON'
{ "run": { "scales": [0.75, 2.5], "edges": [0.8, 1.5], "least_branch": 40, "tracked": "even",
           "motion": "tracked", "seed": [[0.13, 0.25, 0.33], [-19.87, -29.98, -15.7]] },
  "cases": [
    { "name": "given", "input": "own/good/series.json", "truth": "own/good" },
    { "name": "bad", "input": "own/bad/series.json", "truth": "own/good" },
    { "name": "made", "phantom": { "seed": 2, "phases": 3, "spacing": 1.6, "window": 0, "surface_spacing": 1.5,
                                   "centerline_spacing": 3 } },
    { "name": "slow", "phantom": { "seed": 4, "phases": 3, "spacing": 0.5 }, "time_limit": 0.3 } ] }
JSON
  run 0 cohort cases.json --output never --dry-run
  [ "$(grep -c 'is to be done' stdout)" = 4 ] || fail "--dry-run: $(cat stdout)"
  [ ! -e never ] || fail "--dry-run wrote"

  # One has a damaged image, one is too slow, the process of one is killed: the fourth has its table.
  "$program" cohort cases.json --output one --no-pictures >stdout 2>stderr &
  cohort=$!
  for _ in $(seq 1000); do
    process=$(pgrep -f "^coronary-pipeline run .*--output $work/one/made/run") && break
    sleep 0.2
  done
  kill -KILL "$process"
  wait "$cohort"
  [ $? = 1 ] || fail "cohort with failed cases: not exit code 1"
  expect_text stderr "3 of 4 cases failed: bad, made, slow"
  grep -q '"message": ".*phase_00.mha' one/cohort.json || fail "cohort.json: $(cat one/cohort.json)"
  expect_text one/cohort.json "after the time limit of 0.3 s"
  expect_text one/cohort.json "run was ended by signal 9"
  [ "$(grep -c '"state": "done"' one/cohort.json)" = 1 ] || fail "$(cat one/cohort.json)"
  grep -q '^A,"given"' one/evaluation/table1.csv || fail "no given: $(cat one/evaluation/table1.csv)"
  grep -q made one/evaluation/table1.csv && fail "a failed case is in the table"

  # Nothing is done twice; what failed only when it is asked for.
  cp -r one/evaluation first
  run 1 cohort cases.json --output one --no-pictures
  [ "$(wc -l <stderr)" = 1 ] || fail "something was done again: $(cat stderr)"
  cmp first/table1.json one/evaluation/table1.json || fail "other tables"
  run 1 cohort cases.json --output one --no-pictures --retry-failed --jobs 2
  grep -q '^\[3/3\]' stderr || fail "not all failed ones again: $(cat stderr)"
  expect_text stderr "2 of 4 cases failed: bad, slow"
  # The page has other words, too.
  grep -o '"name":"[a-z]*"' one/evaluation/review.html >one/evaluation/names.txt
  for file in table1.csv table1.tex table1.json names.txt; do
    grep -q made one/evaluation/$file || fail "no made in $file"
    grep -q given one/evaluation/$file || fail "no given in $file"
    grep -q slow one/evaluation/$file && fail "slow in $file"
  done
  grep -q '^B,' one/evaluation/table1.csv || fail "no Part B: $(cat one/evaluation/table1.csv)"

  # Killed in the midst, gone on with in a part, and on ranks: the same tables.
  "$program" cohort cases.json --output killed --no-pictures --quiet &
  cohort=$!
  until_there killed/given/run/weights.vtu
  kill -KILL "$cohort"
  wait "$cohort" 2>/dev/null
  run 0 cohort cases.json --output killed --part 1 4 --no-pictures --quiet
  [ ! -e killed/evaluation ] || fail "a part made tables"
  if command -v mpirun >/dev/null; then
    on_ranks 2 1 cohort cases.json --output killed --no-pictures
    expect_text stderr "on rank 1"
    grep -q "given: begun" stderr && fail "done twice: $(cat stderr)"
  else
    run 1 cohort cases.json --output killed --no-pictures
  fi
  for file in table1.csv table1.tex table1.json branches.csv; do
    cmp one/evaluation/$file killed/evaluation/$file || fail "$file is not what it is without the kill"
  done

  # Another setting is another case.
  sed 's/"seed": 2,/"seed": 5,/' cases.json >other.json
  run 0 cohort other.json --output one --dry-run
  expect_text stdout "made: is to be done: its settings or files have changed"
  expect_text stdout "given: is done"
}

check_cohort_input() {
  mkdir there
  echo x >there/image.mha
  for wrong in '{}/cases' '{ "cases": [] }/cases' '{ "case": [] }/case' \
    '{ "cases": [ { "name": "a" } ] }/cases[0]' \
    '{ "cases": [ { "input": "there" } ] }/cases[0].name' \
    '{ "cases": [ { "name": "a|b", "input": "there" } ] }/cases[0].name' \
    '{ "cases": [ { "name": "..", "input": "there" } ] }/cases[0].name' \
    '{ "cases": [ { "name": "evaluation", "input": "there" } ] }/cases[0].name' \
    '{ "cases": [ { "name": "a", "input": "there" }, { "name": "a", "input": "there" } ] }/cases[1].name' \
    '{ "cases": [ { "name": "a", "input": "nowhere" } ] }/cases[0].input' \
    '{ "cases": [ { "name": "a", "input": ["there", 1] } ] }/cases[0].input[1]' \
    '{ "cases": [ { "name": "a", "input": "there", "thruth": "there" } ] }/cases[0].thruth' \
    '{ "cases": [ { "name": "a", "input": "there", "truth": "nowhere" } ] }/cases[0].truth' \
    '{ "cases": [ { "name": "a", "input": "there", "run": { "scals": 1 } } ] }/cases[0].run' \
    '{ "cases": [ { "name": "a", "input": "there", "run": { "threads": 1 } } ] }/cases[0].run.threads' \
    '{ "cases": [ { "name": "a", "phantom": { "sed": 1 } } ] }/cases[0].phantom' \
    '{ "cases": [ { "name": "a", "phantom": { "spacing": 1000 } } ] }/cases[0].phantom' \
    '{ "cases": [ { "name": "a", "phantom": {}, "time_limit": 0 } ] }/cases[0].time_limit' \
    '{ "cases": [ { "name": "a", "phantom": {} } ], "evaluate": { "clip": true } }/evaluate'; do
    echo "${wrong%/*}" >wrong.json
    run 1 cohort wrong.json --output result
    expect_one_line "coronary-pipeline cohort" "cohort.$(echo "${wrong##*/}" | sed 's/[][]/./g')"
  done
  echo '{' >wrong.json
  run 1 cohort wrong.json --output result
  expect_one_line "coronary-pipeline cohort" "'wrong.json' is not JSON"
  run 1 cohort nowhere.json --output result
  expect_one_line "coronary-pipeline cohort" "nowhere.json"
  run 2 cohort wrong.json --output result --part 3 2
  expect_one_line "coronary-pipeline cohort" "--part"
  [ ! -e result ] || fail "a folder was made for nothing"
}

"check_$case"
if [ "$failures" -gt 0 ]; then
  echo "$failures check(s) failed"
  exit 1
fi
echo "ok: $case"
