! A rod that is clamped at s = 0 and loaded by its weight, a force and a moment at s = 1, for AUTO-07p; units: l, D w.
! U = (r, q, n, m): place, quaternion (scalar first) of the frame t_x, t_y, t_z, force and moment in the rod, in space.
! PAR(1): share of the loads, from 0 (shape at rest) to 1.
!   r' = R v, v = e_z + C R^T n;  q' = q o (0, k) / 2, k = rest + B^-1 R^T m;  n' = -share w;  m' = n x r'
! (Antman, Nonlinear Problems of Elasticity, chapter 8: a rod that shears and stretches; q by Euler parameters.)
module bar_case
  implicit none
  double precision, save :: bend(3), compliance(3), rest(3), start(3), clamp(4), weight(3), force(3), couple(3)
end module

subroutine func(ndim, u, icp, par, ijac, f, dfdu, dfdp)
  use bar_case
  implicit none
  integer, intent(in) :: ndim, icp(*), ijac
  double precision, intent(in) :: u(ndim), par(*)
  double precision, intent(out) :: f(ndim)
  double precision, intent(inout) :: dfdu(ndim, ndim), dfdp(ndim, *)
  double precision :: r(3, 3), k(3), v(3), t(3), q(4)
  q = u(4:7)
  call rotation(q, r)
  v = compliance*matmul(transpose(r), u(8:10))
  v(3) = v(3) + 1d0
  k = rest + matmul(transpose(r), u(11:13))/bend
  t = matmul(r, v)
  f(1:3) = t
  f(4) = -0.5d0*dot_product(q(2:4), k)
  f(5) = 0.5d0*(q(1)*k(1) + q(3)*k(3) - q(4)*k(2))
  f(6) = 0.5d0*(q(1)*k(2) + q(4)*k(1) - q(2)*k(3))
  f(7) = 0.5d0*(q(1)*k(3) + q(2)*k(2) - q(3)*k(1))
  f(8:10) = -par(1)*weight
  f(11) = u(9)*t(3) - u(10)*t(2)
  f(12) = u(10)*t(1) - u(8)*t(3)
  f(13) = u(8)*t(2) - u(9)*t(1)
end subroutine

subroutine rotation(q, r)
  implicit none
  double precision, intent(in) :: q(4)
  double precision, intent(out) :: r(3, 3)
  double precision :: s
  s = 2d0/dot_product(q, q)
  r(1, 1) = 1d0 - s*(q(3)**2 + q(4)**2)
  r(1, 2) = s*(q(2)*q(3) - q(1)*q(4))
  r(1, 3) = s*(q(2)*q(4) + q(1)*q(3))
  r(2, 1) = s*(q(2)*q(3) + q(1)*q(4))
  r(2, 2) = 1d0 - s*(q(2)**2 + q(4)**2)
  r(2, 3) = s*(q(3)*q(4) - q(1)*q(2))
  r(3, 1) = s*(q(2)*q(4) - q(1)*q(3))
  r(3, 2) = s*(q(3)*q(4) + q(1)*q(2))
  r(3, 3) = 1d0 - s*(q(2)**2 + q(3)**2)
end subroutine

subroutine stpnt(ndim, u, par, t)
  use bar_case
  implicit none
  integer, intent(in) :: ndim
  double precision, intent(inout) :: u(ndim), par(*)
  double precision, intent(in) :: t
  double precision :: size, angle, axis(3), along(3), off(3), turned(3), local(3), p(4), r(3, 3)
  logical, save :: begun = .false.
  if (.not. begun) then
    open(77, file='bar.txt', status='old')
    read(77, *) bend, compliance, rest, start, clamp, weight, force, couple
    close(77)
    begun = .true.
  end if
  par(1) = 0d0
  u = 0d0
  along = (/ 0d0, 0d0, 1d0 /)
  size = sqrt(dot_product(rest, rest))
  call rotation(clamp, r)
  if (size == 0d0) then
    u(1:3) = start + t*matmul(r, along)
    u(4:7) = clamp
    return
  end if
  axis = rest/size
  angle = size*t
  off = along - axis*axis(3)
  turned = (/ axis(2), -axis(1), 0d0 /)
  local = t*axis(3)*axis + (sin(angle)*off + (1d0 - cos(angle))*turned)/size
  u(1:3) = start + matmul(r, local)
  p(1) = cos(0.5d0*angle)
  p(2:4) = sin(0.5d0*angle)*axis
  u(4) = clamp(1)*p(1) - dot_product(clamp(2:4), p(2:4))
  u(5) = clamp(1)*p(2) + p(1)*clamp(2) + clamp(3)*p(4) - clamp(4)*p(3)
  u(6) = clamp(1)*p(3) + p(1)*clamp(3) + clamp(4)*p(2) - clamp(2)*p(4)
  u(7) = clamp(1)*p(4) + p(1)*clamp(4) + clamp(2)*p(3) - clamp(3)*p(2)
end subroutine

subroutine bcnd(ndim, par, icp, nbc, u0, u1, fb, ijac, dbc)
  use bar_case
  implicit none
  integer, intent(in) :: ndim, icp(*), nbc, ijac
  double precision, intent(in) :: par(*), u0(ndim), u1(ndim)
  double precision, intent(out) :: fb(nbc)
  double precision, intent(inout) :: dbc(nbc, *)
  fb(1:3) = u0(1:3) - start
  fb(4:7) = u0(4:7) - clamp
  fb(8:10) = u1(8:10) - par(1)*force
  fb(11:13) = u1(11:13) - par(1)*couple
end subroutine

subroutine icnd(ndim, par, icp, nint, u, uold, udot, upold, fi, ijac, dint)
  integer ndim, icp(*), nint, ijac
  double precision par(*), u(*), uold(*), udot(*), upold(*), fi(*), dint(nint, *)
end subroutine

subroutine fopt(ndim, u, icp, par, ijac, fs, dfdu, dfdp)
  integer ndim, icp(*), ijac
  double precision u(*), par(*), fs, dfdu(*), dfdp(*)
end subroutine

subroutine pvls(ndim, u, par)
  integer ndim
  double precision u(*), par(*)
end subroutine
